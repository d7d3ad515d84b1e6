// Pixels of images, addressed from the top left, in fragment and compute passes alike. Images lie in memory as on the
// CPU, upper row first, so OpenGL's own lower left corner never shows; reach pixels through these functions only.
// The host declares: passSize (px of this pass's target), the samplers, and what storePixel writes to.

// This invocation's pixel: (column, row from the top). In a compute pass that runs over rows or columns, OVER
// decides what x and y count.
ivec2 pixel() {
#ifdef BRUME_COMPUTE
    return ivec2(gl_GlobalInvocationID.xy);
#else
    return ivec2(gl_FragCoord.xy);
#endif
}

// Edges replicate.
vec4 fetch(sampler2D image, ivec2 p) {
    return texelFetch(image, clamp(p, ivec2(0), textureSize(image, 0) - 1), 0);
}

#ifdef BRUME_COMPUTE
void storePixel(ivec2 p, vec4 color) { imageStore(brume_target, p, color); }
void store(vec4 color) { storePixel(pixel(), color); }
#else
void store(vec4 color) { brume_color = color; }
#endif

// Multiplies this effect's transmittance into the running image; nothing where nobody reads it.
void storeTransmittance(vec3 transmittance) {
#ifdef BRUME_TRANSMITTANCE
    brume_transmittance = vec4(transmittance, 1.0);
#endif
}

// Classes by bits: a compiler may assume that arithmetic never meets a NaN.
bool isNan(float x) { return (floatBitsToUint(x) & 0x7fffffffu) > 0x7f800000u; }
bool isInf(float x) { return (floatBitsToUint(x) & 0x7fffffffu) == 0x7f800000u; }
