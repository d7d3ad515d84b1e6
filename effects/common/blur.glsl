// Separable blurs; twin of blur_cpu.hpp. Include after kit/image.glsl. Edges replicate.
// The effect's DERIVED declares: taps, reach (FIR); factor, prefilterReach, prefilter, smallTaps, smallReach, enlarging (decimated).

// One bad pixel must not spread over a whole blur.
float finite(float x) { return isNan(x) ? 0.0 : (isInf(x) ? (x > 0.0 ? 65504.0 : -65504.0) : clamp(x, -1e38, 1e38)); }
vec4 finiteFetch(sampler2D image, ivec2 p) {
    vec4 c = fetch(image, p);
    return vec4(finite(c.r), finite(c.g), finite(c.b), finite(c.a));
}

const ivec2 alongRow = ivec2(1, 0), alongColumn = ivec2(0, 1);

// 1. The FIR of `taps`, along rows or columns; in short sums, as thousands of terms of about one size in one
// fp32 sum are each rounded the same way.
const int longestSum = 128;
vec4 fir(sampler2D image, ivec2 p, ivec2 along) {
    vec4 whole = vec4(0), sum = taps[0] * finiteFetch(image, p);
    for (int t = 1; t <= reach; t++) {
        if (t % longestSum == 0) {
            whole += sum;
            sum = vec4(0);
        }
        sum += taps[t] * (finiteFetch(image, p - t * along) + finiteFetch(image, p + t * along));
    }
    return whole + sum;
}

// 2. Decimated: the prefilter round every factor-th pixel; the small image has `smallMargin` px more on each side.
const int smallMargin = 5;
vec4 decimated(sampler2D image, ivec2 p, ivec2 along) {
    ivec2 center = p + along * ((factor - 1) * (p - smallMargin) - smallMargin);
    vec4 sum = prefilter[0] * finiteFetch(image, center);
    for (int t = 1; t <= prefilterReach; t++)
        sum += prefilter[t] * (finiteFetch(image, center - t * along) + finiteFetch(image, center + t * along));
    return sum;
}

// 3. The FIR of the small image.
vec4 smallFir(sampler2D image, ivec2 p, ivec2 along) {
    vec4 sum = smallTaps[0] * fetch(image, p);
    for (int t = 1; t <= smallReach; t++)
        sum += smallTaps[t] * (fetch(image, p - t * along) + fetch(image, p + t * along));
    return sum;
}

// 4. Back up: six numbers of enlarging a phase weigh small pixels -2 to 3; of four boxes the outer ones are 0.
vec4 enlarged(sampler2D image, ivec2 p, ivec2 along) {
    int place = p.x * along.x + p.y * along.y, w = 6 * (place % factor);
    ivec2 small0 = p + along * (place / factor + smallMargin - place);
    vec4 sum = vec4(0.0);
    for (int m = 0; m < 6; m++)
        if (enlarging[w + m] != 0.0) sum += enlarging[w + m] * fetch(image, small0 + (m - 2) * along);
    return sum;
}
