/*{
  "DESCRIPTION": "Gaussian blur of any radius, by several methods.",
  "CREDIT": "extended box: Gwosdek, Grewenig, Bruhn, Weickert 2011; dual filter: Bjørge 2015; Pascal rows: the ocean fog of Direct3D 10",
  "CATEGORIES": ["Blur"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "radius", "TYPE": "float", "UNIT": "px", "DEFAULT": 8, "MIN": 0, "MAX": 1000, "UI_MAX": 100,
     "LABEL": "Radius", "HINT": "standard deviation, in px of the full frame"},
    {"NAME": "method", "TYPE": "long", "VALUES": [0, 1, 2, 3, 4, 5],
     "LABELS": ["fir", "recursive", "decimated", "box", "pascal", "dual_filter"], "AUTO": true, "DEFAULT": "auto", "LABEL": "Method",
     "HINT": "fir costs what the radius asks; the others cost the same at any radius; dual_filter is what GPUs do for speed, only near a Gaussian; auto is the cheapest whose error does not show on this frame, or that keeps a stated tolerance"},
    {"NAME": "tolerance", "TYPE": "float", "AUTO": true, "DEFAULT": "auto", "MIN": 1e-6, "MAX": 0.1, "LABEL": "Tolerance",
     "HINT": "how far a pixel may be off, as a share of the brightest within its blur, of decimated never more than 1e-3; once stated it is enough for method auto, even where it shows; auto: whatever does not show on this frame, at most 1e-3",
     "WHEN": "$method != $method_box && $method != $method_dual_filter && $method != $method_recursive"}
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
    {"NAME": "poleCount", "TYPE": "int", "FROM": ["radius", "method", "size"]},
    {"NAME": "poles", "TYPE": "vec4 array", "SIZE": "$poleCount", "FROM": ["radius", "method", "size"]},
    {"NAME": "poleOrigin", "TYPE": "float", "FROM": ["radius", "method", "size"]},
    {"NAME": "centerTap", "TYPE": "float", "FROM": ["radius", "method", "size"]},
    {"NAME": "boxReach", "TYPE": "int", "FROM": ["radius", "method", "size"]},
    {"NAME": "boxWeights", "TYPE": "vec2", "FROM": ["radius", "method", "size"]},
    {"NAME": "dualLevels", "TYPE": "int", "FROM": ["radius", "method", "size"]},
    {"NAME": "dualOffset", "TYPE": "float", "FROM": ["radius", "method", "size"]},
    {"NAME": "dualShare", "TYPE": "float", "FROM": ["radius", "method", "size"]}
  ],
  "PASSES": [
    {"TARGET": "rows", "WHEN": "$method == $method_fir || $method == $method_pascal"},
    {"WHEN": "$method == $method_fir || $method == $method_pascal"},

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
     "WHEN": "$method == $method_recursive"},
    {"TARGET": "rowsRecursive", "COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$HEIGHT", 1]},
     "WHEN": "$method == $method_recursive"},
    {"TARGET": "columnsForward", "COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$WIDTH", 1]},
     "WHEN": "$method == $method_recursive"},
    {"COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$WIDTH", 1]}, "WHEN": "$method == $method_recursive"},

    {"TARGET": "boxRows", "COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$HEIGHT", 1]}, "REPEAT": 3,
     "WHEN": "$method == $method_box"},
    {"TARGET": "boxColumns", "COMPUTE": {"LOCAL_SIZE": [32, 1, 1], "OVER": ["$WIDTH", 1]}, "REPEAT": 3,
     "WHEN": "$method == $method_box"},
    {"WHEN": "$method == $method_box"},

    {"TARGET": "down1", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 1, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 1, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels >= 1"},
    {"TARGET": "down2", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 2, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 2, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels >= 2"},
    {"TARGET": "down3", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 3, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 3, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels >= 3"},
    {"TARGET": "down4", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 4, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 4, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels >= 4"},
    {"TARGET": "down5", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 5, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 5, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels >= 5"},
    {"TARGET": "down6", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 6, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 6, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels >= 6"},
    {"TARGET": "up5", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 5, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 5, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels > 5"},
    {"TARGET": "up4", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 4, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 4, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels > 4"},
    {"TARGET": "up3", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 3, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 3, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels > 3"},
    {"TARGET": "up2", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 2, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 2, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels > 2"},
    {"TARGET": "up1", "WIDTH": "(floor(($WIDTH - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 1, 0))",
     "HEIGHT": "(floor(($HEIGHT - 1) / pow(2, $dualLevels)) + 9) * pow(2, max($dualLevels - 1, 0))",
     "WHEN": "$method == $method_dual_filter && $dualLevels > 1"},
    {"WHEN": "$method == $method_dual_filter"}
  ],
  "TOLERANCE": {"ABS": 2e-6, "REL": 1e-5, "REFERENCE": 4e-6, "MEASURED": 0.7,
    "REASON": "long sums in another order, beside brighter pixels; each method's own error is stated by the reference and widens its bound only"},
  "CHART": {
    "REFERENCE": {"method": "fir", "tolerance": 0.001},
    "CASES": [
      {"NAME": "radius 2", "SET": {"radius": 2}}, {"NAME": "radius 8", "SET": {"radius": 8}},
      {"NAME": "radius 32", "SET": {"radius": 32}}, {"NAME": "radius 128", "SET": {"radius": 128}}
    ],
    "METHODS": [
      {"NAME": "fir", "SET": {"method": "fir"}, "KNOB": "tolerance", "VALUES": [0.1, 0.01, 0.001, 1e-4, 1e-5]},
      {"NAME": "decimated", "SET": {"method": "decimated"}, "KNOB": "tolerance", "VALUES": [0.001, 1e-4, 1e-5]},
      {"NAME": "recursive", "SET": {"method": "recursive"}},
      {"NAME": "box", "SET": {"method": "box"}},
      {"NAME": "pascal", "SET": {"method": "pascal"}, "CASES": ["radius 2", "radius 8"]},
      {"NAME": "dual_filter", "SET": {"method": "dual_filter"}}
    ],
    "PEERS": [{"NAME": "cv::GaussianBlur", "RUN": "peer_opencv"}, {"NAME": "FFmpeg gblur", "RUN": "peer_ffmpeg.py"}]
  },
  "BREAKS": [
    "box has an error of .05 of a bright point's height, and each of its three boxes replicates edges for itself",
    "pascal only knows radii whose square is a multiple of 1/2: below .5 it is the identity",
    "dual_filter's kernel is only near a Gaussian: off by .8 of the brightest input at radius 1, .28 from 2.9 to 106, more beyond, where its taps part; it depends on where a point lies, on the CPU it is a plain, slow twin, and in GLSL without a GPU its many small passes take four times as long as decimated (llvmpipe, 960 × 540, radius 8 and 32: 63 and 74 ms against 19 and 15)",
    "decimated is fir below radius 2.58 (3.04, 3.6 at tolerances of 1e-4, 1e-5); it depends on where a point lies between small pixels by its error",
    "replicated edges keep constants but not the mean"
  ],
  "STABILITY": [
    {"NAME": "radius", "STRESS": {"NAME": "radius", "UNIT": "px", "RANGE": [0.1, 1000]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 640, "HEIGHT": 2}, "SET": {"radius": "$stress", "tolerance": 1e-5},
     "HOLDS": {"box": [], "dual_filter": [], "pascal": [[0.1, 0.2], [5, 1000]]}},
    {"NAME": "radius out of range", "STRESS": {"NAME": "radius", "UNIT": "px", "VALUES": [0], "REFUSED": [-1, 1001, "inf", "NaN"]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 24, "HEIGHT": 8}, "SET": {"radius": "$stress"}},
    {"NAME": "image size", "STRESS": {"NAME": "width and height", "UNIT": "px", "VALUES": [1, 2, 3, 5, 8, 13, 21, 34, 55]},
     "FRAME": {"SCENE": "lamps", "WIDTH": "$stress", "HEIGHT": "$stress"}, "SET": {"radius": 20, "tolerance": 1e-5},
     "HOLDS": {"box": [1, 2], "dual_filter": [1, 5]}},
    {"NAME": "columns", "STRESS": {"NAME": "height of an image one px wide", "UNIT": "px", "VALUES": [1, 2, 3, 5, 8, 20, 50, 200]},
     "FRAME": {"SCENE": "lamps", "WIDTH": 1, "HEIGHT": "$stress"}, "SET": {"radius": 20, "tolerance": 1e-5},
     "HOLDS": {"box": [1, 2], "dual_filter": [1, 3]}},
    {"NAME": "one bright pixel", "STRESS": {"NAME": "brightness", "RANGE": [1, 50000]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 201, "HEIGHT": 3, "PIXEL": "$stress"}, "SET": {"radius": 8, "tolerance": 1e-6},
     "HOLDS": {"box": [], "dual_filter": [], "pascal": [1, 2000]}},
    {"NAME": "one bright pixel, default tolerance", "STRESS": {"NAME": "brightness", "RANGE": [1, 50000]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 201, "HEIGHT": 3, "PIXEL": "$stress"}, "SET": {"radius": 8}, "METHODS": ["fir", "recursive", "decimated"]},
    {"NAME": "a pixel that is no number", "STRESS": {"NAME": "value", "VALUES": ["-inf", "inf", "NaN"]},
     "FRAME": {"SCENE": "lamp", "WIDTH": 201, "HEIGHT": 3, "PIXEL": "$stress"}, "SET": {"radius": 8, "tolerance": 1e-6},
     "HOLDS": {"fir": [["-inf", "-inf"], ["NaN", "NaN"]], "recursive": ["NaN", "NaN"], "box": [["-inf", "-inf"], ["NaN", "NaN"]], "dual_filter": [["-inf", "-inf"], ["NaN", "NaN"]],
      "pascal": [["-inf", "-inf"], ["NaN", "NaN"]]}}
  ]
}*/
#include "kit/image.glsl"
#include "common/blur.glsl"
#include "common/recursion.glsl"
#include "common/dual_filter.glsl"

#ifdef BRUME_COMPUTE
// Extended box: 2·boxReach + 1 px of weight boxWeights.x and one more on each side of weight boxWeights.y; a running
// sum, in fp64 so that a bright pixel leaves nothing behind.
void box(sampler2D image, ivec2 first, ivec2 step, int count) {
    dvec4 sum = dvec4(0.0);
    for (int t = -boxReach; t <= boxReach; t++) sum += dvec4(finiteFetch(image, first + t * step));
    for (int n = 0; n < count; n++) {
        ivec2 p = first + n * step;
        dvec4 next = dvec4(finiteFetch(image, p + (boxReach + 1) * step));
        dvec4 before = dvec4(finiteFetch(image, p - (boxReach + 1) * step));
        storePixel(p, vec4(double(boxWeights.x) * sum + double(boxWeights.y) * (before + next)));
        sum += next - dvec4(finiteFetch(image, p - boxReach * step));
    }
}

void main() {
    int line = int(gl_GlobalInvocationID.x);
    ivec2 last = passSize - 1;
#if defined(PASS_rowsForward)
    if (line <= last.y) recursion(inputImage, inputImage, false, ivec2(0, line), alongRow, passSize.x);
#elif defined(PASS_rowsRecursive)
    if (line <= last.y) recursion(inputImage, rowsForward, true, ivec2(last.x, line), -alongRow, passSize.x);
#elif defined(PASS_columnsForward)
    if (line <= last.x) recursion(rowsRecursive, rowsRecursive, false, ivec2(line, 0), alongColumn, passSize.y);
#elif defined(PASS_boxRows)
    if (line > last.y) return;
    if (passRepeat == 0) box(inputImage, ivec2(0, line), alongRow, passSize.x);
    else box(boxRows, ivec2(0, line), alongRow, passSize.x);
#elif defined(PASS_boxColumns)
    if (line > last.x) return;
    if (passRepeat == 0) box(boxRows, ivec2(line, 0), alongColumn, passSize.y);
    else box(boxColumns, ivec2(line, 0), alongColumn, passSize.y);
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
#elif defined(PASS_down1)
    store(halved(inputImage, p));
#elif defined(PASS_down2)
    store(halved(down1, p));
#elif defined(PASS_down3)
    store(halved(down2, p));
#elif defined(PASS_down4)
    store(halved(down3, p));
#elif defined(PASS_down5)
    store(halved(down4, p));
#elif defined(PASS_down6)
    store(halved(down5, p));
#elif defined(PASS_up5)
    store(doubled(down6, p));
#elif defined(PASS_up4)
    if (dualLevels == 5) store(doubled(down5, p));
    else store(doubled(up5, p));
#elif defined(PASS_up3)
    if (dualLevels == 4) store(doubled(down4, p));
    else store(doubled(up4, p));
#elif defined(PASS_up2)
    if (dualLevels == 3) store(doubled(down3, p));
    else store(doubled(up3, p));
#elif defined(PASS_up1)
    if (dualLevels == 2) store(doubled(down2, p));
    else store(doubled(up2, p));
#else
    if (method == method_decimated) store(enlarged(enlargedColumns, p, alongRow));
    else if (method == method_box) store(fetch(boxColumns, p));
    else if (method == method_dual_filter) {
        vec4 blurred = dualLevels == 1 ? doubled(down1, p) : doubled(up1, p);
        store(dualShare < 1.0 ? mix(finiteFetch(inputImage, p), blurred, dualShare) : blurred);
    }
    else store(fir(rows, p, alongColumn));
#endif
}
#endif
