// What fog_blur.fs declares.
#pragma once

namespace fog_blur {

enum Method { ladderMethod, gatherMethod };
enum Order { separate, single };
enum Edges { keep, bleed };

struct FogBlur {
    float radius, start, falloff;
    int order, edges, method, rungs;
};

}  // namespace fog_blur
