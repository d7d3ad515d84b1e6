uniform mat4 worldFromClip;
in vec2 ndc;
out vec4 color;

void main() {
    vec4 nearer = worldFromClip * vec4(ndc, 1, 1), farther = worldFromClip * vec4(ndc, .5, 1);
    color = vec4(skyRadiance(normalize(farther.xyz / farther.w - nearer.xyz / nearer.w)), 1);
}
