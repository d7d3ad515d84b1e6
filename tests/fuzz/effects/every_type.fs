/*{
    "SPACE": "linear",
    "INPUTS": [
        {"NAME": "inputImage", "TYPE": "image"},
        {"NAME": "other", "TYPE": "image", "DEFAULT": "captured"},
        {"NAME": "method", "TYPE": "long", "VALUES": [0, 1, 2], "LABELS": ["fir", "box 3", "recursive"], "DEFAULT": "auto", "AUTO": true},
        {"NAME": "count", "TYPE": "long", "DEFAULT": 3, "MIN": 1, "MAX": 64},
        {"NAME": "on", "TYPE": "bool", "DEFAULT": true},
        {"NAME": "density", "TYPE": "float", "DEFAULT": 0.5, "MIN": 0, "MAX": 1, "UNIT": "1/m"},
        {"NAME": "start", "TYPE": "float", "DEFAULT": -1, "AUTO": true},
        {"NAME": "place", "TYPE": "point2D", "DEFAULT": [0, 1]},
        {"NAME": "wind", "TYPE": "point3D", "DEFAULT": [1, 0, 0]},
        {"NAME": "tint", "TYPE": "color", "DEFAULT": [0.5, 0.6, 0.7, 1]},
        {"NAME": "boxes", "TYPE": "list", "MAX": 4, "FIELDS": [
            {"NAME": "size", "TYPE": "point3D", "DEFAULT": [1, 1, 1], "MIN": [0, 0, 0]},
            {"NAME": "kind", "TYPE": "long", "VALUES": [0, 1], "LABELS": ["box", "ball"], "DEFAULT": 0}]}
    ]
}*/
void main() { setColor(inputColor()); }
