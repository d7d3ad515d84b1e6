layout(location = 0) in vec3 position;
layout(location = 1) in vec3 normal;
layout(location = 2) in vec3 albedo;
layout(location = 3) in float occlusion;
layout(location = 4) in vec2 uv;

uniform mat4 clipFromWorld;
uniform vec4 clipPlane;  // what lies on its negative side is cut away

out vec3 worldPosition;
out vec3 worldNormal;
out vec3 baseAlbedo;
out float skyShare;
out vec2 surfaceUv;
out float gl_ClipDistance[1];
invariant gl_Position;  // the depth-only program must land on the same depths

void main() {
    worldPosition = position;
    worldNormal = normal;
    baseAlbedo = albedo;
    skyShare = occlusion;
    surfaceUv = uv;
    gl_Position = clipFromWorld * vec4(position, 1);
    gl_ClipDistance[0] = dot(clipPlane, vec4(position, 1));
}
