// What every fog effect does last; twin of fog.hpp. Include after kit/image.glsl.

// 1. Opacity 1 - exp(-τ): GLSL has no expm1, so a series where the difference would cancel.
vec3 opacityOf(vec3 opticalDepth) {
    vec3 t = opticalDepth;
    vec3 series = t * (1.0 - t / 2.0 * (1.0 - t / 3.0 * (1.0 - t / 4.0 * (1.0 - t / 5.0 * (1.0 - t / 6.0 *
                  (1.0 - t / 7.0 * (1.0 - t / 8.0)))))));
    return mix(1.0 - exp(-t), series, lessThan(t, vec3(0.5)));
}

// 2. Transmittance and opacity of an optical depth ≥ 0, which may be inf.
void extinctionOf(vec3 opticalDepth, out vec3 transmittance, out vec3 opacity) {
    opticalDepth = min(opticalDepth, vec3(104.0));
    opacity = opacityOf(opticalDepth);
    transmittance = mix(exp(-opticalDepth), vec3(0.0), greaterThanEqual(opticalDepth, vec3(87.0)));
}

// 3. Composite C·T + A·(1 - T); where nothing of the scene is left, not even infinity shows.
void storeFog(vec4 scene, vec3 airlight, vec3 transmittance, vec3 opacity) {
    vec3 left = mix(vec3(0.0), scene.rgb, greaterThan(transmittance, vec3(0.0)));
    store(vec4(left * transmittance + airlight * opacity, scene.a));
    storeTransmittance(transmittance);
}
