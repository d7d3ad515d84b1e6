// Light arriving at a surface: sun with shadow, sky and ground, lamps.
in vec3 worldPosition;
in vec3 worldNormal;
in vec3 baseAlbedo;
in float skyShare;
in vec2 surfaceUv;
out vec4 color;

uniform vec3 eye;
uniform vec3 ambientUp, ambientDown;
uniform mat4 nearShadowFromWorld, farShadowFromWorld;
layout(binding = 0) uniform sampler2DShadow nearShadow;
layout(binding = 1) uniform sampler2DShadow farShadow;
layout(binding = 2) uniform sampler2D mirrorImage;
uniform mat4 clipFromWorldWhole;  // of the whole frame, where clipFromWorld may be one tile of it
uniform int lightCount;
uniform vec4 lightPosition[24];  // w: range
uniform vec3 lightColor[24];
uniform vec3 lightAttenuation[24];

struct Surface {
    vec3 albedo;
    vec3 normal;
    float occlusion;
    float shine;     // Blinn exponent
    float specular;  // reflectance facing it
    float through;   // share of light that passes through, as leaves do
    vec3 emitted;
};

float lookUp(sampler2DShadow map, vec3 place) {
    vec2 texel = 1. / vec2(textureSize(map, 0));
    float sum = 0.;
    for (int y = -1; y <= 1; y++)
        for (int x = -1; x <= 1; x++) sum += texture(map, vec3(place.xy + vec2(x, y) * texel, place.z));
    return sum / 9.;
}

float sunVisible(vec3 p, vec3 n) {
    float slope = 1. - max(0., dot(n, sunDirection));
    vec3 near = (nearShadowFromWorld * vec4(p + n * (.02 + .06 * slope), 1)).xyz;
    if (all(greaterThan(near, vec3(.01))) && all(lessThan(near, vec3(.99))))
        return lookUp(nearShadow, near - vec3(0, 0, .0004));
    vec3 far = (farShadowFromWorld * vec4(p + n * FAR_BIAS * (.4 + slope), 1)).xyz;
    if (all(greaterThan(far, vec3(0))) && all(lessThan(far, vec3(1)))) return lookUp(farShadow, far - vec3(0, 0, .0003));
    return 1.;
}

float highlight(vec3 n, vec3 toLight, vec3 toEye, float shine) {
    vec3 halfway = normalize(toLight + toEye);
    return (shine + 8.) / 8. * pow(max(0., dot(n, halfway)), shine);
}

vec3 lit(Surface s, float sunShare) {
    vec3 toEye = normalize(eye - worldPosition);
    float facing = dot(s.normal, sunDirection);
    vec3 diffuse = sunColor * sunShare * (max(0., facing) + s.through * max(0., -facing));
    diffuse += mix(ambientDown, ambientUp, .5 + .5 * s.normal.y) * s.occlusion;
    vec3 shiny = sunColor * sunShare * max(0., facing) * highlight(s.normal, sunDirection, toEye, s.shine);
    for (int k = 0; k < lightCount; k++) {
        vec3 towards = lightPosition[k].xyz - worldPosition;
        float d = length(towards);
        if (d > lightPosition[k].w) continue;
        towards /= d;
        vec3 arriving = lightColor[k] / dot(lightAttenuation[k], vec3(1, d, d * d));
        float cosine = dot(s.normal, towards);
        diffuse += arriving * (max(0., cosine) + s.through * max(0., -cosine));
        shiny += arriving * max(0., cosine) * highlight(s.normal, towards, toEye, s.shine);
    }
    return s.albedo * diffuse + s.specular * shiny + s.emitted;
}

// A normal tilted by the slope of a height function's two differences.
vec3 bumped(vec3 n, vec2 slope) {
    vec3 along = normalize(abs(n.y) < .99 ? cross(vec3(0, 1, 0), n) : vec3(1, 0, 0)), up = cross(n, along);
    return normalize(n - along * slope.x - up * slope.y);
}

float footprint() {  // of a pixel, m
    vec3 across = fwidth(worldPosition);
    return max(across.x, max(across.y, across.z));
}
