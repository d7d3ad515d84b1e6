// Step 8 of volume_fog.fs: the light that reaches a step and is scattered towards the eye.

// 8. share of sunlight that arrives at `at` m
float shadeStep(Ray ray, float at) {
    bool hasMatrix = any(notEqual(shadow[0].xyz, vec3(0.0)));
    if (!hasMatrix || shadow_strength <= 0.0) return 1.0;
    vec2 size = vec2(textureSize(shadow_map, 0));
    precise float du = shadow[0].x * ray.d.x + shadow[0].y * ray.d.y + shadow[0].z * ray.d.z;
    precise float dv = shadow[1].x * ray.d.x + shadow[1].y * ray.d.y + shadow[1].z * ray.d.z;
    precise float dd = shadow[2].x * ray.d.x + shadow[2].y * ray.d.y + shadow[2].z * ray.d.z;
    precise float u = (shadow[0].w + du * at) * size.x;
    precise float v = (shadow[1].w + dv * at) * size.y;
    precise float d = shadow[2].w + dd * at;
    if (!(u >= 0.0 && u < size.x && v >= 0.0 && v < size.y && d <= 1.0)) return 1.0;
    return d > fetch(shadow_map, ivec2(int(u), int(v))).r ? 1.0 - shadow_strength : 1.0;
}

// 8.1 an angle of 0..π from its sine and cosine times anything positive; GLSL's own atan may be 4096 ulp off
float angleOf(float sine, float cosine) {
    float a = abs(cosine);
    float q = min(sine, a) / max(max(sine, a), 1e-30);
    float t = q / (1.0 + sqrt(1.0 + q * q));
    float s = t * t;
    float arctan = 2.0 * t * (1.0 + s * (-0.333333333 + s * (0.2 + s * (-0.142857143 + s * (0.111111111 +
                   s * (-0.0909090909 + s * (0.0769230769 - s * 0.05)))))));
    float acute = sine > a ? 1.57079633 - arctan : arctan;
    return cosine < 0.0 ? 3.14159265 - acute : acute;
}

// 8.2 light of lamp k: its mean over the part of the step within its range. By midpoint, or (equiangular) with
// 1/(distance² + core²) integrated exactly as the angle it subtends, the rest taken at the angle's middle.
vec3 meanOfLamp(Ray ray, Step s, int k) {
    vec4 passing = passLamp(ray, k), light = lamps[3 * k + 1], c = lamps[3 * k + 2];
    float apart2 = passing.y;
    float from = max(passing.z, s.t0);
    float length_ = max(min(passing.w, s.t1) - from, 0.0);
    if (length_ <= 0.0) return vec3(0.0);
    float a = from - passing.x, b = a + length_;  // m past the closest approach
    float share = light.w / max(s.t1 - s.t0, 1e-30);
    float beyond, mean;
    if (method == method_equiangular) {
        float core2 = apart2 + c.w, core = sqrt(core2);
        float ra = sqrt(core2 + a * a), rb = sqrt(core2 + b * b);
        beyond = (a * rb + b * ra) / (ra + rb);
        float distance2 = apart2 + beyond * beyond;
        float attenuation = c.x + c.y * sqrt(distance2) + c.z * distance2;
        mean = share * (angleOf(core * length_, core2 + a * b) / core) * ((core2 + beyond * beyond) / attenuation);
    } else {
        beyond = a + s.u * length_;
        float distance2 = apart2 + beyond * beyond;
        mean = share * length_ / (c.x + c.y * sqrt(distance2) + c.z * distance2);
    }
    // The versine of the angle to the lamp, without cancellation looking into it.
    float g = asymmetry() < 0.0 ? -beyond : beyond;
    float distance_ = max(sqrt(apart2 + g * g), 1e-18);
    float versine = g < 0.0 ? apart2 / (distance_ * (distance_ - g)) : 1.0 + g / distance_;
    return mean * scatteredShare(versine) * light.rgb;
}

vec3 lightStep(Ray ray, Step s, vec3 sunlight) {
    vec3 light = ambient.rgb * ambient_intensity + shadeStep(ray, s.at) * sunlight;
    for (int k = 0; k < point_lights_count; k++) light += meanOfLamp(ray, s, k);
    return light;
}
