/*{
  "DESCRIPTION": "Blur that grows with the fog in front of a surface.",
  "CREDIT": "Gawron and Boryczka 2018",
  "CATEGORIES": ["Blur", "Fog"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "transmittance", "TYPE": "image", "DEFAULT": "transmittance", "LABEL": "Transmittance",
     "HINT": "of the fog so far; what it hides decides the blur"},
    {"NAME": "clear", "TYPE": "image", "DEFAULT": "captured", "LABEL": "Clear image",
     "HINT": "the picture before fog", "WHEN": "$order == $order_single"},
    {"NAME": "radius", "TYPE": "float", "UNIT": "px", "DEFAULT": 4, "MIN": 0, "MAX": 64, "UI_MAX": 32,
     "LABEL": "Radius", "HINT": "standard deviation under full fog, in px of the full frame"},
    {"NAME": "start", "TYPE": "float", "DEFAULT": 0, "MIN": 0, "MAX": 0.99, "LABEL": "Start",
     "HINT": "opacity from which on there is blur"},
    {"NAME": "falloff", "TYPE": "float", "DEFAULT": 1, "MIN": 0.25, "MAX": 8, "UI_MAX": 4, "LABEL": "Falloff",
     "HINT": "exponent: above 1 the blur grows late"},
    {"NAME": "order", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["separate", "single"], "DEFAULT": 0, "LABEL": "Order",
     "HINT": "separate: blur the foggy picture; single: as if the clear picture had been blurred before the fog"},
    {"NAME": "edges", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["keep", "bleed"], "DEFAULT": 0, "LABEL": "Edges",
     "HINT": "keep: a surface in thinner fog does not bleed into what lies behind it"},
    {"NAME": "method", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["ladder", "gather"], "AUTO": true, "DEFAULT": 0,
     "LABEL": "Method", "HINT": "ladder mixes, for each pixel, the nearest four of a few evenly blurred pictures: milliseconds, and off by at most a fiftieth of the brightest light within the pixel's blur, less with more rungs; gather weighs each pixel's surroundings by themselves: exact, and seconds a frame; auto tries ladders on the picture, and takes gather only where their errors show"},
    {"NAME": "rungs", "TYPE": "long", "VALUES": [1, 2, 4, 8], "LABELS": ["1", "2", "4", "8"], "AUTO": true, "DEFAULT": 1,
     "LABEL": "Rungs", "HINT": "how many evenly blurred pictures there are to a doubling of the blur's variance: more are more exact and slower",
     "WHEN": "$method == $method_ladder"}
  ],
  "DERIVED": [
    {"NAME": "largestSigma", "TYPE": "float", "FROM": ["radius", "size"]},
    {"NAME": "levelCount", "TYPE": "int", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "levels", "TYPE": "vec4 array", "SIZE": "$levelCount", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "levelTables", "TYPE": "vec4 array", "SIZE": "$levelCount", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "stripWidth", "TYPE": "int", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "tapCount", "TYPE": "int", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "levelTaps", "TYPE": "array", "SIZE": "$tapCount", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "prefilterCount", "TYPE": "int", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "prefilters", "TYPE": "array", "SIZE": "$prefilterCount", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "phaseCount", "TYPE": "int", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "phases", "TYPE": "array", "SIZE": "6 * $phaseCount", "FROM": ["radius", "rungs", "size"]},
    {"NAME": "nodeWeights", "TYPE": "vec4 array", "SIZE": "17 * $levelCount + 1", "FROM": ["radius", "rungs", "size"]}
  ],
  "PASSES": [
    {"TARGET": "sharp"},
    {"TARGET": "decimatedRows", "WIDTH": "$stripWidth", "HEIGHT": "$rungs * ($HEIGHT + 10)", "WHEN": "$method != $method_gather"},
    {"TARGET": "decimatedBoth", "WIDTH": "$stripWidth", "HEIGHT": "$rungs * ($HEIGHT + 10)", "WHEN": "$method != $method_gather"},
    {"TARGET": "blurredRows", "WIDTH": "$stripWidth", "HEIGHT": "$rungs * ($HEIGHT + 10)", "WHEN": "$method != $method_gather"},
    {"TARGET": "blurred", "WIDTH": "$stripWidth", "HEIGHT": "$rungs * ($HEIGHT + 10)", "WHEN": "$method != $method_gather"},
    {}
  ],
  "TOLERANCE": {"ABS": 2e-6, "REL": 3e-5, "REFERENCE": 6e-6,
    "MEASURED": 0.92,
    "REASON": "against the reference: weighted sums are divided by their weights, which may be as small as .05; the ladder's own error is stated by the reference"},
  "CHART": {
    "BEFORE": ["depth_fog"],
    "CASES": [
      {"NAME": "radius 4", "SET": {"radius": 4}}, {"NAME": "radius 16", "SET": {"radius": 16}},
      {"NAME": "radius 16, edges bleed", "SET": {"radius": 16, "edges": "bleed"}}
    ],
    "METHODS": [
      {"NAME": "ladder", "SET": {"method": "ladder"}, "KNOB": "rungs", "VALUES": [1, 2, 4, 8]},
      {"NAME": "gather", "SET": {"method": "gather"}}
    ]
  },
  "BREAKS": [
    "ladder: a pixel may be off by a fiftieth (.02) of the brightest light within its blur, somewhat more beside silhouettes that are kept. That is seen only in the dark beside bright lights",
    "ladder: a picture that blurs differently from place to place, and keeps edges, needs many rungs to be exact beside bright lights in the dark; each doubling takes about half of the error or more away",
    "auto tries ladders on the picture itself, which takes 84 to 147 ms in the median and up to 900 at 1280x720 on two cores: ask for a method where frames have to be quick",
    "gather: costs as many taps as its largest blur covers, (8 radii)²: choose ladder where speed counts more",
    "edges: bleed mixes up to half of a near surface into what lies behind its silhouette",
    "GLSL keeps the ladder in one strip about eight times as wide as the frame, of more rungs in one so many times as high: too wide for 4K on some drivers"
  ],
  "STABILITY": [
    {"NAME": "radius", "STRESS": {"NAME": "radius", "UNIT": "px", "RANGE": [0.1, 50], "VALUES": [64], "REFUSED": [-1, 65, 1000, "inf", "NaN"]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 48, "HEIGHT": 12}, "SET": {"radius": "$stress", "edges": "bleed"},
     "BREAKS": "the ladder may be off by a fiftieth of a lamp, which shows in the dark beside it; this frame is lamps in the dark",
     "HOLDS": {"ladder": [[0.1, 0.5], [20, 64]]}},
    {"NAME": "radius, edges kept", "STRESS": {"NAME": "radius", "UNIT": "px", "RANGE": [0.1, 50], "VALUES": [64], "REFUSED": [65]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 48, "HEIGHT": 12}, "SET": {"radius": "$stress", "edges": "keep"},
     "BREAKS": "the ladder may be off by a fiftieth of a lamp, which shows in the dark beside it; this frame is lamps in the dark",
     "HOLDS": {"ladder": [0.1, 0.2]}},
    {"NAME": "falloff", "STRESS": {"NAME": "falloff exponent", "VALUES": [0.25, 0.5, 1, 2, 4, 8], "REFUSED": [-1, 0, 9]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 48, "HEIGHT": 12}, "SET": {"radius": 4, "falloff": "$stress", "edges": "bleed"},
     "BREAKS": "the ladder may be off by a fiftieth of a lamp, which shows in the dark beside it; this frame is lamps in the dark",
     "HOLDS": {"ladder": []}},
    {"NAME": "image size", "STRESS": {"NAME": "width and height", "UNIT": "px", "VALUES": [1, 2, 3, 5, 8, 13, 21]},
     "FRAME": {"SCENE": "lamps", "WIDTH": "$stress", "HEIGHT": "$stress"}, "SET": {"radius": 20},
     "BREAKS": "the ladder may be off by a fiftieth of a lamp, which shows in the dark beside it; this frame is lamps in the dark",
     "HOLDS": {"ladder": [1, 8]}},
    {"NAME": "one bright pixel", "STRESS": {"NAME": "brightness", "VALUES": [1, 10, 100, 1000, 65504, 1e30, "inf", "NaN"]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 33, "HEIGHT": 9, "PIXEL": "$stress"}, "SET": {"radius": 4},
     "BREAKS": "gather ends at 4 standard deviations, which beside a light of 150 and more shows in black",
     "HOLDS": {"ladder": ["NaN", "NaN"], "gather": [[1, 100], ["NaN", "NaN"]], "auto": [[1, 100], ["NaN", "NaN"]]}}
  ]
}*/
#include "kit/image.glsl"

float finite(float x) { return isNan(x) ? 0.0 : (isInf(x) ? (x > 0.0 ? 65504.0 : -65504.0) : x); }
vec3 finite3(vec3 c) { return vec3(finite(c.r), finite(c.g), finite(c.b)); }

// 1. Standard deviation of a pixel's blur: grows with the opacity in front of it.
float sigmaAt(ivec2 p) {
    vec3 t = finite3(fetch(transmittance, p).rgb);
    float opacity = 1.0 - (t.r + t.g + t.b) * (1.0 / 3.0);
    float share = clamp((opacity - start) / (1.0 - start), 0.0, 1.0);
    return share > 0.0 ? largestSigma * pow(share, falloff) : 0.0;
}

// 2. What a blur of sigma takes from a pixel: colour times weight, and the weight.
vec4 weighed(ivec2 p, float sigma) {
    vec4 s = fetch(sharp, p);
    float weight = edges == edges_bleed ? 1.0 : (s.a < sigma ? s.a / sigma : 1.0);
    return vec4(s.rgb * weight, weight);
}

// 3. The ladder, level beside level in one strip, or in two shelves that they take turns at: levels is sigma, factor,
// left column, reach; levelTables where its taps, prefilter and phases begin, and its width.
int shelfHeight() { return textureSize(sharp, 0).y + 10; }
int shelfTop(int l) { return l % rungs * shelfHeight(); }
int levelAt(ivec2 p) {
    int l = min(p.y / shelfHeight(), levelCount - 1);
    while (l + rungs < levelCount && p.x >= int(levels[l + rungs].z)) l += rungs;
    return l;
}
int levelHeight(int l) { return (textureSize(sharp, 0).y - 1) / int(levels[l].y) + 11; }

vec4 stripFetch(sampler2D image, int l, ivec2 small) {
    small = clamp(small, ivec2(0), ivec2(int(levelTables[l].w), levelHeight(l)) - 1);
    return fetch(image, ivec2(int(levels[l].z) + small.x, shelfTop(l) + small.y));
}

vec4 decimatedRow(int l, ivec2 small) {
    int factor = int(levels[l].y), offset = int(levelTables[l].y);
    ivec2 center = ivec2((small.x - 5) * factor, small.y);
    vec4 sum = prefilters[offset] * weighed(center, levels[l].x);
    for (int t = 1; t <= 2 * (factor - 1); t++)
        sum += prefilters[offset + t] * (weighed(center - ivec2(t, 0), levels[l].x) + weighed(center + ivec2(t, 0), levels[l].x));
    return sum;
}
vec4 decimatedColumn(int l, ivec2 small) {
    int factor = int(levels[l].y), offset = int(levelTables[l].y), left = int(levels[l].z) + small.x;
    int center = (small.y - 5) * factor, top = shelfTop(l);
    int last = textureSize(sharp, 0).y - 1;
    vec4 sum = prefilters[offset] * fetch(decimatedRows, ivec2(left, top + clamp(center, 0, last)));
    for (int t = 1; t <= 2 * (factor - 1); t++)
        sum += prefilters[offset + t] * (fetch(decimatedRows, ivec2(left, top + clamp(center - t, 0, last))) +
                                         fetch(decimatedRows, ivec2(left, top + clamp(center + t, 0, last))));
    return sum;
}
vec4 levelFir(sampler2D image, int l, ivec2 small, ivec2 along) {
    int offset = int(levelTables[l].x), reach = int(levels[l].w);
    vec4 sum = levelTaps[offset] * stripFetch(image, l, small);
    for (int t = 1; t <= reach; t++)
        sum += levelTaps[offset + t] * (stripFetch(image, l, small - t * along) + stripFetch(image, l, small + t * along));
    return sum;
}
vec4 enlargedLevel(int l, ivec2 p) {
    int factor = int(levels[l].y), offset = int(levelTables[l].z);
    ivec2 small = p / factor + 5;
    if (factor == 1) return stripFetch(blurred, l, small);
    int across = 6 * (offset + p.x % factor), down = 6 * (offset + p.y % factor);
    vec4 sum = vec4(0.0);
    for (int m = 1; m < 5; m++) {
        vec4 column = vec4(0.0);
        for (int n = 1; n < 5; n++) column += phases[down + n] * stripFetch(blurred, l, small + ivec2(m - 2, n - 2));
        sum += phases[across + m] * column;
    }
    return sum;
}

// 4. Between four levels of the ladder. Variances of an octave are evenly apart, so the bits of a pixel's variance say
// which, and where between them; the last of one rung is less far.
vec4 ladder(ivec2 p, vec4 self) {
    bool isCoarse = rungs == 1;
    float top = isCoarse ? 1.75 : 2.0, lastFrom = isCoarse ? 1.0 : 2.0 - 1.0 / float(rungs);
    int rungBits = isCoarse ? 0 : rungs == 2 ? 1 : rungs == 4 ? 2 : 3;
    float octaves = float(1 << ((levelCount - 1) / rungs - 1)), strength = self.a > 0.0 ? self.a / largestSigma : 0.0;
    float x = strength * strength * (top * octaves), place = x;
    int interval = 0;
    if (x >= 1.0) {
        int bits = floatBitsToInt(x);
        interval = (bits >> (23 - rungBits)) - (127 << rungBits) + 1;
        place = intBitsToFloat(((bits << rungBits) & 0x007fffff) | 0x3f800000) - 1.0;
        if (interval >= levelCount - 1) {
            interval = levelCount - 1;
            place = min((x / octaves - lastFrom) / (top - lastFrom), 1.0);
        }
    }
    float sampled = place * 16.0;
    int below = int(sampled);
    vec4 a = nodeWeights[17 * interval + below], b = nodeWeights[17 * interval + below + 1];
    vec4 weights = a + (sampled - float(below)) * (b - a);
    int first = clamp(interval - 1, 0, max(0, levelCount - 3));
    vec4 sum = vec4(0.0);
    for (int k = 0; k < 4; k++) {
        int node = first + k;
        if (node > levelCount) break;
        sum += weights[k] * (node == 0 ? vec4(self.rgb, 1.0) : enlargedLevel(node - 1, p));
    }
    return sum;
}

// The same by the definition. What lies beyond an edge is the edge's.
float tail(float scale, int from, int reach) {
    float sum = 0.0;
    for (int d = from; d <= reach; d++) sum += exp(-float(d * d) * scale);
    return sum;
}
vec4 gather(ivec2 p, vec4 self) {
    if (self.a <= 0.0) return vec4(self.rgb, 1.0);
    float scale = 0.5 / max(self.a * self.a, 1e-4);
    int reach = int(ceil(4.0 * self.a));
    ivec2 last = textureSize(sharp, 0) - 1, low = max(p - reach, ivec2(0)), high = min(p + reach, last);
    vec2 before = vec2(tail(scale, p.x, reach), tail(scale, p.y, reach));
    vec2 after = vec2(tail(scale, last.x - p.x, reach), tail(scale, last.y - p.y, reach));
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int y = low.y; y <= high.y; y++) {
        float wy = exp(-float((y - p.y) * (y - p.y)) * scale);
        if (y == 0) wy = before.y;
        if (y == last.y) wy = y == 0 ? before.y + after.y - (p.y == y ? 1.0 : 0.0) : after.y;
        for (int x = low.x; x <= high.x; x++) {
            float w = exp(-float((x - p.x) * (x - p.x)) * scale);
            if (x == 0) w = before.x;
            if (x == last.x) w = x == 0 ? before.x + after.x - (p.x == x ? 1.0 : 0.0) : after.x;
            sum += w * wy * weighed(ivec2(x, y), self.a);
            total += w * wy;
        }
    }
    return sum / total;
}

// 5. Divides by the weight; where hardly any is left, the pixel itself makes up for it.
vec3 blurredColor(ivec2 p) {
    vec4 self = fetch(sharp, p);
    if (self.a <= 0.0) return self.rgb;
    vec4 sum = method == method_gather ? gather(p, self) : ladder(p, self);
    if (edges == edges_bleed) return sum.rgb;
    float weight = max(sum.a, 0.05);
    return (sum.rgb + (weight - sum.a) * self.rgb) / weight;
}

void main() {
    ivec2 p = pixel();
#if defined(PASS_sharp)
    vec3 scene = order == order_single ? fetch(clear, p).rgb : fetch(inputImage, p).rgb;
    store(vec4(finite3(scene), sigmaAt(p)));
#elif defined(PASS_output)
    vec4 foggy = fetch(inputImage, p);
    vec3 color = blurredColor(p);
    if (order == order_single) {
        // The fog's own light stays; what it let through of the clear picture is exchanged for the blurred one.
        vec3 change = color - fetch(sharp, p).rgb;
        color = finite3(foggy.rgb) + finite3(fetch(transmittance, p).rgb) * change;
    }
    store(vec4(color, foggy.a));
#else
    int l = levelAt(p);
    ivec2 small = ivec2(p.x - int(levels[l].z), p.y - shelfTop(l));
#if defined(PASS_decimatedRows)
    store(decimatedRow(l, small));
#elif defined(PASS_decimatedBoth)
    store(small.y < levelHeight(l) ? decimatedColumn(l, small) : vec4(0.0));
#elif defined(PASS_blurredRows)
    store(small.y < levelHeight(l) ? levelFir(decimatedBoth, l, small, ivec2(1, 0)) : vec4(0.0));
#else
    store(small.y < levelHeight(l) ? levelFir(blurredRows, l, small, ivec2(0, 1)) : vec4(0.0));
#endif
#endif
}
