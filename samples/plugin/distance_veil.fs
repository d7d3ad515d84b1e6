/*{
  "DESCRIPTION": "A veil of light that thickens with distance: each further halving distance adds half of what is still missing.",
  "CATEGORIES": ["Fog"],
  "ISFVSN": "2",
  "SPACE": "linear",
  "INPUTS": [
    {"NAME": "inputImage", "TYPE": "image"},
    {"NAME": "halving", "TYPE": "float", "UNIT": "m", "DEFAULT": 100, "MIN": 1, "MAX": 1e6, "UI_MAX": 1000,
     "LABEL": "Halving distance", "HINT": "half of the veil lies within this distance along the view ray"},
    {"NAME": "color", "TYPE": "color", "DEFAULT": [0.5, 0.55, 0.6], "MIN": 0, "MAX": 1,
     "LABEL": "Colour", "HINT": "scene-linear light of the whole veil"}
  ],
  "TOLERANCE": {"ABS": 1e-6, "REL": 2e-5, "REFERENCE": 2e-6}
}*/
#include "kit/image.glsl"
#include "kit/view.glsl"

// 1. How much of the veil lies before a surface `distance` metres away: 0 at the eye, 1 before the sky.
float veilBefore(float distance) {
    return isInf(distance) ? 1.0 : 1.0 - exp2(-distance / halving);
}

void main() {
    ivec2 p = pixel();
    vec4 scene = fetch(inputImage, p);
    // 2. Planar depth becomes distance along the view ray.
    float distance = depthAt(p) * rayLength(rayOf(p));
    // 3. The veil only adds light; alpha passes.
    store(vec4(scene.rgb + color.rgb * veilBefore(distance), scene.a));
}
