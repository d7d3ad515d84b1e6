// Recursive blurs as compute passes, one invocation a row or column; twin of recursion.hpp. Include after blur.glsl.
// The effect's DERIVED declares: poles (pole - poleOrigin, amplitude), poleCount <= 3, poleOrigin, and centerTap.
//
// A pass runs one way: state = Σ pole^(m - 1)·x[n ∓ m], m >= 1, and its part of the result is Re(amplitude·state).
// Before the edge all values are the edge's, so the state begins at -x/(pole - 1).

#ifdef BRUME_COMPUTE
struct Complex4 {
    vec4 re, im;
};

Complex4 edgeState(vec4 pole, vec4 x) {
    float re = pole.x + (poleOrigin - 1.0), scale = -1.0 / (re * re + pole.y * pole.y);
    return Complex4(x * (re * scale), x * (-pole.y * scale));
}

// Runs over `count` pixels from `first` in the direction `step`, adding to what `before` holds, if `isSecond`.
void recursion(sampler2D image, sampler2D before, bool isSecond, ivec2 first, ivec2 step, int count) {
    Complex4 state[3];
    vec4 x = finiteFetch(image, first);
    for (int k = 0; k < poleCount; k++) state[k] = edgeState(poles[k], x);
    for (int n = 0; n < count; n++) {
        ivec2 p = first + n * step;
        x = finiteFetch(image, p);
        precise vec4 sum = isSecond ? fetch(before, p) : centerTap * x;
        for (int k = 0; k < poleCount; k++) {
            vec4 pole = poles[k];
            sum += pole.z * state[k].re - pole.w * state[k].im;
            precise vec4 re = (pole.x * state[k].re - pole.y * state[k].im) + x;
            precise vec4 im = pole.x * state[k].im + pole.y * state[k].re;
            state[k].re = poleOrigin * state[k].re + re;
            state[k].im = poleOrigin * state[k].im + im;
        }
        storePixel(p, sum);
    }
}
#endif
