// The camera of the image being worked on; twin of view.hpp. Include after kit/image.glsl.
// The host declares: view_size, view_frameSize, view_inverseFocal, view_origin, view_worldFromView, view_eye.

// Planar view depth in m; +inf is sky, never NaN.
float depthAt(ivec2 p) { return fetch(depthImage, p).r; }

// 1. the ray of a pixel: ((i + .5 - cx)/fx, -(j + .5 - cy)/fy, -1)
vec3 rayOf(ivec2 p) {
    precise vec2 r = (vec2(p) + view_origin) * view_inverseFocal;
    return vec3(r.x, -r.y, -1.0);
}
// 2. its length: distance along the ray per metre of planar depth
float rayLength(vec3 ray) {
    precise float squared = ray.x * ray.x + (ray.y * ray.y + 1.0);
    return sqrt(squared);
}
// 3. its unit direction in the world
vec3 directionOf(vec3 ray) { return view_worldFromView * (ray * (1.0 / rayLength(ray))); }

// px of this image per px of the frame: what a radius in px is multiplied by
float pixelScale() { return float(view_size.x) / float(view_frameSize.x); }
