out vec2 ndc;

void main() {
    ndc = vec2(gl_VertexID == 1 ? 3 : -1, gl_VertexID == 2 ? 3 : -1);
    gl_Position = vec4(ndc, 0, 1);  // depth is reversed: 0 is the farthest
}
