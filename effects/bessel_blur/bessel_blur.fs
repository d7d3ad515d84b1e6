/*{
  "DESCRIPTION": "Second-order Bessel low-pass, forward and back: a glow with a sharper core and longer tails than a Gaussian's.",
  "CREDIT": "Spirit Fog (a ReShade effect)",
  "CATEGORIES": ["Blur"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "radius", "TYPE": "float", "UNIT": "px", "DEFAULT": 8, "MIN": 0, "MAX": 1000, "UI_MAX": 100,
     "LABEL": "Radius", "HINT": "standard deviation, in px of the full frame: .8165 of the filter's time constant"},
    {"NAME": "method", "TYPE": "long", "VALUES": [0, 1, 2, 3, 4],
     "LABELS": ["fir", "recursive", "decimated", "hold", "bilinear"], "AUTO": true, "DEFAULT": "auto",
     "LABEL": "Method", "HINT": "recursive is exact at any radius; hold and bilinear are the textbook discretisations; auto is the cheapest whose error does not show on this frame, or that keeps a stated tolerance"},
    {"NAME": "tolerance", "TYPE": "float", "AUTO": true, "DEFAULT": "auto", "MIN": 1e-6, "MAX": 0.1, "LABEL": "Tolerance",
     "HINT": "how far a pixel may be off, as a share of the brightest within its blur, of decimated never more than 1e-3; once stated it is enough for method auto, even where it shows; auto: whatever does not show on this frame, at most 1e-3",
     "WHEN": "$method == $method_fir || $method == $method_decimated"}
  ],
  "DERIVED": [
    {"NAME": "reach", "TYPE": "int", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "taps", "TYPE": "array", "SIZE": "$reach + 1", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "factor", "TYPE": "int", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "prefilterReach", "TYPE": "int", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "prefilter", "TYPE": "array", "SIZE": "$prefilterReach + 1", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "smallReach", "TYPE": "int", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "smallTaps", "TYPE": "array", "SIZE": "$smallReach + 1", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "enlarging", "TYPE": "array", "SIZE": "6 * $factor", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "poleCount", "TYPE": "int", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "poles", "TYPE": "vec4 array", "SIZE": "$poleCount", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "poleOrigin", "TYPE": "float", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "centerTap", "TYPE": "float", "FROM": ["radius", "method", "tolerance", "size"]},
    {"NAME": "cascadeReach", "TYPE": "int", "FROM": ["radius", "method", "tolerance", "size"], "DESCRIPTION": "the CPU's alone, as cascade"},
    {"NAME": "cascade", "TYPE": "array", "SIZE": 13, "FROM": ["radius", "method", "tolerance", "size"]}
  ],
  "PASSES": [
    {"TARGET": "rows", "WHEN": "$method == $method_fir"},
    {"WHEN": "$method == $method_fir"},

    {"TARGET": "decimatedRows", "WIDTH": "floor(($WIDTH - 1) / $factor) + 11", "WHEN": "$method == $method_decimated"},
    {"TARGET": "decimatedBoth", "WIDTH": "floor(($WIDTH - 1) / $factor) + 11",
     "HEIGHT": "floor(($HEIGHT - 1) / $factor) + 11", "WHEN": "$method == $method_decimated"},
    {"TARGET": "smallRows", "WIDTH": "floor(($WIDTH - 1) / $factor) + 11",
     "HEIGHT": "floor(($HEIGHT - 1) / $factor) + 11", "WHEN": "$method == $method_decimated"},
    {"TARGET": "smallBoth", "WIDTH": "floor(($WIDTH - 1) / $factor) + 11",
     "HEIGHT": "floor(($HEIGHT - 1) / $factor) + 11", "WHEN": "$method == $method_decimated"},
    {"TARGET": "enlargedColumns", "WIDTH": "floor(($WIDTH - 1) / $factor) + 11", "WHEN": "$method == $method_decimated"},
    {"WHEN": "$method == $method_decimated"},

    {"TARGET": "rowsForward", "COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$HEIGHT", 1]},
     "WHEN": "$method != $method_fir && $method != $method_decimated"},
    {"TARGET": "rowsRecursive", "COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$HEIGHT", 1]},
     "WHEN": "$method != $method_fir && $method != $method_decimated"},
    {"TARGET": "columnsForward", "COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$WIDTH", 1]},
     "WHEN": "$method != $method_fir && $method != $method_decimated"},
    {"COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$WIDTH", 1]}, "WHEN": "$method != $method_fir && $method != $method_decimated"}
  ],
  "TOLERANCE": {"ABS": 2e-6, "REL": 3e-5, "REFERENCE": 4e-6, "MEASURED": 0.8,
    "REASON": "long sums in another order, beside brighter pixels: most where the kernel passes through 0 a few px from one 10000 times as bright, of which a recursion keeps a rounded rest; each method's own error is stated by the reference and widens its bound only"},
  "CHART": {
    "REFERENCE": {"method": "fir", "tolerance": 0.001},
    "CASES": [
      {"NAME": "radius 2", "SET": {"radius": 2}}, {"NAME": "radius 8", "SET": {"radius": 8}},
      {"NAME": "radius 32", "SET": {"radius": 32}}, {"NAME": "radius 128", "SET": {"radius": 128}}
    ],
    "METHODS": [
      {"NAME": "fir", "SET": {"method": "fir"}, "KNOB": "tolerance", "VALUES": [0.1, 0.01, 0.001, 1e-4, 1e-5]},
      {"NAME": "decimated", "SET": {"method": "decimated"}, "KNOB": "tolerance", "VALUES": [0.001, 1e-4]},
      {"NAME": "recursive", "SET": {"method": "recursive"}},
      {"NAME": "hold", "SET": {"method": "hold"}},
      {"NAME": "bilinear", "SET": {"method": "bilinear"}}
    ]
  },
  "BREAKS": [
    "the kernel is negative beyond 3.7 radii: dark rings of .43 % of a bright light's height",
    "a separable pair is not round: 7.7 times brighter on the axes than on the diagonals at 3.7 radii",
    "bilinear rings below radius 1, where its poles tend to -1, and is off by .14 there; hold by .02",
    "decimated is recursive below radius 6.2",
    "replicated edges keep constants but not the mean"
  ],
  "STABILITY": [
    {"NAME": "radius", "STRESS": {"NAME": "radius", "UNIT": "px", "RANGE": [0.1, 1000]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 640, "HEIGHT": 2}, "SET": {"radius": "$stress", "tolerance": 1e-5},
     "HOLDS": {"hold": [5, 1000], "bilinear": [5, 1000]}},
    {"NAME": "radius out of range", "STRESS": {"NAME": "radius", "UNIT": "px", "VALUES": [0], "REFUSED": [-1, 1001, "inf", "NaN"]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 24, "HEIGHT": 8}, "SET": {"radius": "$stress"}},
    {"NAME": "image size", "STRESS": {"NAME": "width and height", "UNIT": "px", "VALUES": [1, 2, 3, 5, 8, 13, 21, 34, 55]},
     "FRAME": {"SCENE": "lamps", "WIDTH": "$stress", "HEIGHT": "$stress"}, "SET": {"radius": 20, "tolerance": 1e-5}},
    {"NAME": "columns", "STRESS": {"NAME": "height of an image one px wide", "UNIT": "px", "VALUES": [1, 2, 3, 5, 8, 20, 50, 200]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 1, "HEIGHT": "$stress"}, "SET": {"radius": 20, "tolerance": 1e-5}},
    {"NAME": "one bright pixel", "STRESS": {"NAME": "brightness", "RANGE": [1, 50000]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 201, "HEIGHT": 3, "PIXEL": "$stress"}, "SET": {"radius": 8, "tolerance": 1e-6},
     "HOLDS": {"hold": [1, 5000], "bilinear": [1, 20]}},
    {"NAME": "one bright pixel, default tolerance", "STRESS": {"NAME": "brightness", "RANGE": [1, 50000]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 201, "HEIGHT": 3, "PIXEL": "$stress"}, "SET": {"radius": 8}, "METHODS": ["fir", "recursive", "decimated"]},
    {"NAME": "a pixel that is no number", "STRESS": {"NAME": "value", "VALUES": ["-inf", "inf", "NaN"]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 201, "HEIGHT": 3, "PIXEL": "$stress"}, "SET": {"radius": 8, "tolerance": 1e-6},
     "HOLDS": {"hold": ["NaN", "NaN"], "bilinear": ["NaN", "NaN"]}}
  ]
}*/
#include "kit/image.glsl"
#include "common/blur.glsl"
#include "common/recursion.glsl"

#ifdef BRUME_COMPUTE
void main() {
    int line = int(gl_GlobalInvocationID.x);
    ivec2 last = passSize - 1;
#if defined(PASS_rowsForward)
    if (line <= last.y) recursion(inputImage, inputImage, false, ivec2(0, line), alongRow, passSize.x);
#elif defined(PASS_rowsRecursive)
    if (line <= last.y) recursion(inputImage, rowsForward, true, ivec2(last.x, line), -alongRow, passSize.x);
#elif defined(PASS_columnsForward)
    if (line <= last.x) recursion(rowsRecursive, rowsRecursive, false, ivec2(line, 0), alongColumn, passSize.y);
#else
    if (line <= last.x) recursion(rowsRecursive, columnsForward, true, ivec2(line, last.y), -alongColumn, passSize.y);
#endif
}
#else
void main() {
    ivec2 p = pixel();
#if defined(PASS_rows)
    store(fir(inputImage, p, alongRow));
#elif defined(PASS_decimatedRows)
    store(decimated(inputImage, p, alongRow));
#elif defined(PASS_decimatedBoth)
    store(decimated(decimatedRows, p, alongColumn));
#elif defined(PASS_smallRows)
    store(smallFir(decimatedBoth, p, alongRow));
#elif defined(PASS_smallBoth)
    store(smallFir(smallRows, p, alongColumn));
#elif defined(PASS_enlargedColumns)
    store(enlarged(smallBoth, p, alongColumn));
#else
    if (method == method_decimated) store(enlarged(enlargedColumns, p, alongRow));
    else store(fir(rows, p, alongColumn));
#endif
}
#endif
