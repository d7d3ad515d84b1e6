// Steps 9 and 10 of volume_fog.fs: what each method does with its steps.

// 9., 10. one sample a step: S·T·(1 - e^-Δτ), exact for constant S
void marchSteps(Ray ray, ivec2 p, vec3 sunlight, float stop, out vec3 scattered, out float transmittance) {
    float depth = 0.0, through = 1.0, shared_ = 0.0;
    vec4 knots = vec4(0.0);
    scattered = vec3(0.0);
    for (int i = 0; i < steps; i++) {
        Step s = placeStep(ray, p, i, method == method_left ? 0.0 : 0.5);
        vec4 fog = addVolumes(ray, s, placeNoise(ray, s, i, shared_, knots));
        if (fog.a > 0.0) {
            float stepDepth = min(fog.a, stop - depth);
            float weight = through * opacityOf(stepDepth);
            scattered += weight * (fog.rgb * (1.0 / max(fog.a, 1e-30))) * lightStep(ray, s, sunlight);
            through -= weight;
            depth += stepDepth;
        }
        if (depth >= stop) break;
    }
    transmittance = fadeOf(depth);
}

// Gauss-Legendre, four nodes a panel: nodes, weights, and the integrals from 0 to node i of the cubic that is 1 at
// node j and 0 at the others
const vec4 nodeAt = vec4(0.069431844, 0.330009478, 0.669990522, 0.930568156);
const vec4 nodeWeight = vec4(0.173927423, 0.326072577, 0.326072577, 0.173927423);
const mat4 nodeIntegral = mat4(0.086963711, -0.026604180, 0.012627463, -0.003555150,
                               0.188118117, 0.163036289, -0.027880429, 0.006735501,
                               0.167191922, 0.353953006, 0.163036289, -0.014190695,
                               0.177482572, 0.313445115, 0.352676758, 0.086963711);

void marchPanels(Ray ray, ivec2 p, int panels, vec3 sunlight, float stop, out vec3 scattered,
                 out float transmittance) {
    float depth = 0.0, through = 1.0, shared_ = 0.0;
    vec4 knots = vec4(0.0);
    scattered = vec3(0.0);
    for (int i = 0; i < panels && depth < stop; i++) {
        vec4 q;
        vec3 light[4];
        for (int j = 0; j < 4; j++) {
            Step s = placeStep(ray, p, i, nodeAt[j]);
            vec4 fog = addVolumes(ray, s, placeNoise(ray, s, i, shared_, knots));
            q[j] = fog.a;
            light[j] = fog.rgb * (1.0 / max(fog.a, 1e-30)) * lightStep(ray, s, sunlight);
        }
        vec4 before, weight;
        for (int j = 0; j < 4; j++) before[j] = max(dot(nodeIntegral[j], q), 0.0);
        // Only ratios of the weights count: from the nearest node on, they cannot all vanish in dense fog.
        float nearest = min(min(before.x, before.y), min(before.z, before.w));
        for (int j = 0; j < 4; j++) weight[j] = nodeWeight[j] * q[j] * fadeOf(before[j] - nearest);
        // Scaled so that a constant S gives S·(1 - e^-Δτ) exactly.
        float panelDepth = min(dot(nodeWeight, q), stop - depth);
        float whole = through * opacityOf(panelDepth);
        float scale = whole / max(weight.x + weight.y + weight.z + weight.w, 1e-30);
        for (int j = 0; j < 4; j++) scattered += scale * weight[j] * light[j];
        through -= whole;
        depth += panelDepth;
    }
    transmittance = fadeOf(depth);
}

// The report's own march (P2 §4): steps from the eye to the surface, wherever the fog is; densities and colours summed
// without transmittance, lights mixed in turn. Its sum passes 1 behind the saturation distance; here it ends at 1.
void marchP2(Ray ray, ivec2 p, out vec3 scattered, out float transmittance) {
    const float saturation = 2.99573227;  // -ln .05: P2's distance to saturation is this over the extinction
    float shared_ = 0.0;
    vec4 knots = vec4(0.0);
    ray.begin = 0.0;
    ray.stride = ray.far * (1.0 / float(steps));
    scattered = vec3(0.0);
    float opacity = 0.0;  // summed from 0: taken from 1, thin steps would lose their last bits
    for (int i = 0; i < steps; i++) {
        Step s = placeStep(ray, p, i, 0.0);
        float noiseFactor = placeNoise(ray, s, i, shared_, knots);
        float density_ = 0.0;
        for (int k = 0; k < volume_count; k++) {
            vec2 inside = clipVolume(ray, k);
            if (s.at >= inside.x && s.at < inside.y)
                density_ += volumes[6 * k].w * (1.0 / saturation) * (ray.stride * falloffOf(ray, k, s.at) * noiseFactor);
        }
        vec3 light = sun_color.rgb * sun_intensity * shadeStep(ray, s.at);
        light += clamp(ambient_intensity, 0.0, 1.0) * (ambient.rgb - light);
        for (int k = 0; k < point_lights_count; k++) {
            vec4 passing = passLamp(ray, k), lamp = lamps[3 * k + 1], c = lamps[3 * k + 2];
            float beyond = s.at - passing.x;
            precise float distance2 = passing.y + beyond * beyond;
            float range = lamps[3 * k].w;
            if (distance2 < range * range)
                light += clamp(lamp.w / (c.x + c.y * sqrt(distance2) + c.z * distance2), 0.0, 1.0) * (lamp.rgb - light);
        }
        density_ = min(density_, 1.0 - opacity);
        scattered += density_ * light;
        opacity += density_;
    }
    transmittance = 1.0 - opacity;
    scattered *= opacity;
}
