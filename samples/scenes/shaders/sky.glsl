uniform vec3 skyZenith, skyHorizon, skyGround, skyGlow;
uniform vec3 sunDirection, sunColor;
uniform float cloudCover;

float cloudDensity(vec2 p) {
    return smoothstep(1. - cloudCover, 1.35 - cloudCover, fractal(p, 6, 0., 71u) * 1.15);
}

vec3 clouds(vec3 radiance, vec3 d) {
    if (cloudCover <= 0. || d.y < .01) return radiance;
    vec2 p = d.xz / (d.y + .06) * 1.1 + vec2(3.7, 1.3);
    float density = cloudDensity(p);
    float towardsSun = cloudDensity(p + normalize(sunDirection.xz) * .12);
    float lit = exp(-1.6 * max(0., towardsSun - .35 * density));
    float forward = pow(max(0., dot(d, sunDirection)), 8.);
    vec3 cloud = mix(skyZenith * .75 + .12, sunColor * (.62 + .5 * forward), lit);
    float fade = smoothstep(.015, .16, d.y);
    return mix(radiance, cloud, density * fade * .85);
}

vec3 stars(vec3 d) {
    vec2 p = vec2(atan(d.x, -d.z), asin(clamp(d.y, -1., 1.))) * 90.;
    ivec2 cell = ivec2(floor(p));
    float chosen = random(cell, 5u);
    vec2 place = vec2(random(cell, 6u), random(cell, 7u)) * .7 + .15;
    float near = length(p - floor(p) - place);
    float size = step(.9, chosen) * (chosen - .9) * 10.;
    return vec3(.8, .9, 1.1) * .5 * size * size * smoothstep(.09, .0, near) * smoothstep(.08, .4, d.y);
}

vec3 skyRadiance(vec3 d) {
    float up = max(d.y, 0.);
    vec3 radiance = mix(skyHorizon, skyZenith, 1. - exp(-4.2 * up));
    float along = max(0., dot(d, sunDirection));
#ifdef NIGHT
    radiance += stars(d);
    radiance += skyGlow * exp(-9. * up);
    float disc = smoothstep(.99980, .99985, along);
    radiance += sunColor * (disc * 16. + .12 * pow(along, 600.));
#else
    radiance += skyGlow * (.28 * pow(along, 6.) + .9 * pow(along, 90.) + 5. * pow(along, 1800.));
    radiance = clouds(radiance, d);
    radiance += sunColor * 24. * smoothstep(.99988, .99992, along);
#endif
    return mix(radiance, skyGround, smoothstep(0., -.02, d.y));
}
