// One function a material; MATERIAL_<name> says which one this program is compiled for.

#if defined(MATERIAL_ForestFloor)
float trailDistance(vec2 p) {
    float t = clamp(-p.y, -40., 60.);
    float centre = 2.3 * sin(t * .085 + .4) - .9 + .0042 * t * t * step(0., t);
    return abs(p.x - centre);
}

Surface surface() {
    vec2 p = worldPosition.xz;
    float pixel = footprint();
    float broad = fractal(p / 17., 3, pixel / 17., 1u);
    float patchy = fractal(p / 2.3, 4, pixel / 2.3, 2u);
    float fine = fractal(p / .11, 3, pixel / .11, 3u);
    vec3 grass = mix(vec3(.055, .095, .022), vec3(.16, .17, .05), smoothstep(.3, .75, .6 * broad + .4 * patchy));
    vec3 needles = mix(vec3(.075, .05, .03), vec3(.15, .105, .06), fine);
    float wood = smoothstep(26., 60., length(p - vec2(2, -18)) + 16. * (broad - .5));
    vec3 albedo = mix(grass, needles, clamp(wood * .85 + smoothstep(.62, .8, patchy) * .5, 0., 1.));
    albedo *= .62 + .76 * fine;
    float trail = smoothstep(1.15, .55, trailDistance(p) + .9 * (patchy - .5) + .35 * (fine - .5));
    vec3 dirt = mix(vec3(.19, .145, .10), vec3(.30, .245, .18), fractal(p / .35, 4, pixel / .35, 5u)) * (.75 + .5 * fine);
    albedo = mix(albedo, dirt, trail);
    float e = .03;
    vec2 slope = vec2(fractal((p + vec2(e, 0)) / .3, 3, pixel / .3, 9u), fractal((p + vec2(0, e)) / .3, 3, pixel / .3, 9u)) -
                 fractal(p / .3, 3, pixel / .3, 9u);
    vec3 n = normalize(vec3(-slope.x, e * 6., -slope.y));
    return Surface(albedo, n, skyShare * (.8 + .2 * fine), 8., .01, 0., vec3(0));
}
#elif defined(MATERIAL_Foliage)
Surface surface() {
    float pixel = footprint();
    vec3 n = normalize(worldNormal);
    // Twigs hang down and outward: noise drawn out along the height.
    vec2 round = vec2(worldPosition.x * .8 + worldPosition.z * .6, worldPosition.y - .35 * worldPosition.x);
    float clumps = fractal(round / vec2(.40, .62), 3, pixel / .40, 11u);
    float needles = fractal(round / vec2(.045, .16), 3, pixel / .045, 12u);
    n = bumped(n, vec2(clumps - .5 + .8 * (needles - .5), .6 * (clumps - .5)) * 2.2);
    float depth = smoothstep(.15, .75, .55 * clumps + .45 * needles);
    vec3 albedo = baseAlbedo * mix(.28, 1.35, depth);
    return Surface(albedo, n, skyShare * mix(.4, 1.1, depth), 12., .015, .28, vec3(0));
}
#elif defined(MATERIAL_Bark)
Surface surface() {
    float pixel = footprint();
    float ridges = fractal(surfaceUv * vec2(14., 2.2), 4, pixel * 14., 21u);
    return Surface(baseAlbedo * (.5 + ridges), bumped(normalize(worldNormal), vec2(ridges - .5, 0) * 1.4), skyShare,
                   8., .01, 0., vec3(0));
}
#elif defined(MATERIAL_Plank)
Surface surface() {
    float pixel = footprint();
    float board = surfaceUv.y / .19, edge = abs(fract(board) - .5);
    float grain = fractal(vec2(surfaceUv.x * 1.1 + 7. * floor(board), surfaceUv.y * 22.), 4, pixel * 22., 31u);
    float tone = random(ivec2(int(floor(board)), 3), 33u);
    float gap = mix(smoothstep(.5, .44, edge), .93, smoothstep(.03, .15, pixel));
    vec3 albedo = baseAlbedo * (.62 + .45 * grain + .35 * tone) * (.25 + .75 * gap);
    return Surface(albedo, normalize(worldNormal), skyShare, 14., .015, 0., vec3(0));
}
#elif defined(MATERIAL_Metal)
Surface surface() {
    float dirt = fractal(surfaceUv * 6., 3, footprint() * 6., 41u);
    return Surface(baseAlbedo * (.75 + .5 * dirt), normalize(worldNormal), skyShare, 60., .12, 0., vec3(0));
}
#elif defined(MATERIAL_Terrain)
Surface surface() {
    vec2 p = worldPosition.xz;
    float pixel = footprint(), height = worldPosition.y;
    vec3 n = normalize(worldNormal);
    float broad = fractal(p / 260., 4, pixel / 260., 51u), fine = fractal(p / 9., 5, pixel / 9., 52u);
    float e = 1.1;
    vec2 slope = vec2(fractal((p + vec2(e, 0)) / 14., 5, pixel / 14., 53u), fractal((p + vec2(0, e)) / 14., 5, pixel / 14., 53u)) -
                 fractal(p / 14., 5, pixel / 14., 53u);
    float steep = 1. - n.y;
    float rocky = smoothstep(.16, .34, steep + .16 * (fine - .5) + .0003 * max(0., height - 330.));
    float E = 9.;
    vec2 gully = vec2(fractal((p + vec2(E, 0)) / 85., 4, pixel / 85., 58u), fractal((p + vec2(0, E)) / 85., 4, pixel / 85., 58u)) -
                 fractal(p / 85., 4, pixel / 85., 58u);
    n = normalize(n + vec3(-slope.x, 0, -slope.y) * mix(.9, 3.4, rocky) + vec3(-gully.x, 0, -gully.y) * mix(.8, 3.2, rocky));
    vec3 meadow = mix(vec3(.085, .115, .030), vec3(.20, .19, .075), smoothstep(.32, .7, .55 * broad + .45 * fine));
    float forest = smoothstep(.50, .58, fractal(p / 190. + 3., 5, pixel / 190., 55u) + .0004 * (150. - height)) *
                   smoothstep(430., 300., height) * smoothstep(6., 22., height) * (1. - rocky);
    vec3 woods = vec3(.022, .040, .016) * (.5 + 1.1 * fractal(p / 6., 3, pixel / 6., 56u));
    float layers = fractal(vec2(height / 7. + 2. * broad, (p.x + p.y) / 160.), 4, pixel / 7., 57u);
    vec3 rock = mix(vec3(.13, .12, .11), vec3(.30, .28, .25), .6 * layers + .4 * fine);
    vec3 albedo = mix(mix(meadow, woods, forest), rock, rocky);
    albedo = mix(albedo, vec3(.25, .22, .17) * (.7 + .6 * fine), smoothstep(3.2, .6, height));  // the shore
    float snow = smoothstep(440., 500., height + 150. * (fine - .5) + 200. * (broad - .5)) * smoothstep(.36, .22, steep + .35 * (fine - .5));
    albedo = mix(albedo, vec3(.80, .83, .88), snow);
    return Surface(albedo * (.75 + .5 * fine), n, skyShare, 10., .01, 0., vec3(0));
}
#elif defined(MATERIAL_Water)
Surface surface() {
    vec2 p = worldPosition.xz;
    float pixel = footprint();
    float distance = length(eye - worldPosition);
    vec2 slope = vec2(0);
    float e = .05;
    for (int k = 0; k < 2; k++) {
        vec2 q = p * (k == 0 ? vec2(.21, .5) : vec2(.07, .12)) + float(k) * 13.;
        float here = fractal(q, 3, pixel * .5, 61u + uint(k));
        slope += vec2(fractal(q + vec2(e, 0), 3, pixel * .5, 61u + uint(k)), fractal(q + vec2(0, e), 3, pixel * .5, 61u + uint(k))) - here;
    }
    slope *= .35 / (1. + distance / 700.);
    float calm = smoothstep(.35, .62, fractal(p / 120., 3, pixel / 120., 67u));
    slope *= .25 + 1.1 * calm;
    vec3 n = normalize(vec3(-slope.x, 1, -slope.y)), toEye = normalize(eye - worldPosition);
    vec4 clip = clipFromWorldWhole * vec4(worldPosition, 1);
    vec2 place = clip.xy / clip.w * .5 + .5 + vec2(slope.x, slope.y * 1.6) * .55;
    vec3 mirrored = texture(mirrorImage, clamp(place, .001, .999)).rgb;
    float fresnel = .02 + .98 * pow(1. - max(0., dot(n, toEye)), 5.);
    vec3 deep = vec3(.010, .030, .034) * (ambientUp + sunColor * .4);
    vec3 emitted = mix(deep, mirrored, fresnel);
    return Surface(vec3(0), n, 1., 900., .02 + .25 * fresnel, 0., emitted);
}
#elif defined(MATERIAL_Asphalt)
// Wet: a film of water over rough stone, deeper in the puddles. The mirror image is spread up and down the
// screen, as a rough surface seen at a low angle spreads it.
Surface surface() {
    vec2 p = worldPosition.xz;
    float pixel = footprint();
    float grain = fractal(p / .035, 2, pixel / .035, 81u), broad = fractal(p / 2.7, 4, pixel / 2.7, 82u);
    float puddle = smoothstep(.50, .60, broad + .06 * (fractal(p / .4, 2, pixel / .4, 84u) - .5));
    vec3 toEye = normalize(eye - worldPosition);
    vec4 clip = clipFromWorldWhole * vec4(worldPosition, 1);
    vec2 place = clip.xy / clip.w * .5 + .5;
    float distance = length(eye - worldPosition);
    vec2 wobble = (vec2(noise(p * 7., 85u), noise(p * 7., 86u)) - .5) * mix(.006, .0015, puddle);
    float spread = mix(.10, .006, puddle) * (.35 + 6. / (6. + distance));
    vec3 mirrored = vec3(0);
    float total = 0.;
    ivec2 cell = ivec2(gl_FragCoord.xy);
    for (int k = 0; k < 12; k++) {
        float t = (float(k) + random(cell, 87u)) / 12. * 2. - 1.;
        float weight = exp(-3. * t * t);
        vec2 at = clamp(place + wobble + vec2(.12 * t * wobble.y * 10., t * spread), .001, .999);
        mirrored += weight * textureLod(mirrorImage, at, mix(2.2, 0., puddle)).rgb;
        total += weight;
    }
    mirrored /= total;
    float grazing = pow(1. - max(0., toEye.y), 5.);
    float strength = mix(.055 + .45 * grazing, .03 + .9 * grazing, puddle);
    vec3 albedo = mix(vec3(.030, .031, .034) * (.5 + grain), vec3(.012), puddle * .8);
    float line = smoothstep(.10, .07, abs(p.x)) * step(fract(p.y / 6.), .5) * smoothstep(.2, .5, grain + .25);
    albedo = mix(albedo, vec3(.34, .33, .30), line * .75 * (1. - puddle));
    vec3 n = bumped(vec3(0, 1, 0), (vec2(grain, noise(p / .03, 88u)) - .5) * mix(.35, .0, puddle));
    return Surface(albedo, n, 1., mix(26., 400., puddle), .03, 0., mirrored * strength);
}
#elif defined(MATERIAL_Paving)
Surface surface() {
    float pixel = footprint();
    vec2 slab = surfaceUv / .6;
    slab.x += .5 * mod(floor(slab.y), 2.);
    vec2 edge = abs(fract(slab) - .5);
    float joint = mix(smoothstep(.5, .47, max(edge.x, edge.y)), .95, smoothstep(.05, .2, pixel));
    float grain = fractal(surfaceUv / .05, 3, pixel / .05, 91u), tone = random(ivec2(floor(slab)), 92u);
    float damp = smoothstep(.35, .7, fractal(surfaceUv / 1.9, 3, pixel / 1.9, 93u));
    vec3 albedo = baseAlbedo * (.6 + .35 * grain + .3 * tone) * (.35 + .65 * joint) * mix(1., .5, damp);
    return Surface(albedo, bumped(normalize(worldNormal), vec2(grain - .5, tone - .5) * .25), skyShare,
                   mix(12., 90., damp), mix(.02, .10, damp), 0., vec3(0));
}
#elif defined(MATERIAL_Facade)
// uv runs in metres from a house's lower left corner; baseAlbedo tells houses apart.
Surface surface() {
    float pixel = footprint();
    uint house = uint(baseAlbedo.r * 4096.) * 131u + uint(baseAlbedo.g * 4096.);
    float storey = 3.2, bay = 2.3;
    vec2 grid = surfaceUv / vec2(bay, storey);
    ivec2 cell = ivec2(floor(grid));
    vec2 at = fract(grid);
    bool shop = cell.y == 0;
    vec2 low = shop ? vec2(.10, .08) : vec2(.24, .26), high = shop ? vec2(.90, .82) : vec2(.76, .84);
    vec2 soft = vec2(pixel / bay, pixel / storey) * .5 + .003;
    vec2 inside = smoothstep(low - soft, low + soft, at) * smoothstep(high + soft, high - soft, at);
    float pane = inside.x * inside.y;
    vec2 framed = smoothstep(low - soft + .03, low + soft + .03, at) * smoothstep(high + soft - .03, high - soft - .03, at);
    float bar = smoothstep(.012, .012 + soft.x * 2., abs(at.x - .5)) * smoothstep(.008, .008 + soft.y * 2., abs(at.y - .62));
    float glass = framed.x * framed.y * bar;

    float chosen = random(cell + ivec2(int(house & 1023u), 0), 103u);
    float on = step(shop ? .45 : .66, chosen) * (surfaceUv.y < 60. ? 1. : 0.);
    float hue = random(cell + ivec2(int(house & 1023u), 9), 104u);
    vec3 light = hue < .62 ? vec3(1.0, .62, .27) : hue < .86 ? vec3(1., .80, .52) : vec3(.55, .70, .85);
    vec2 within = (at - low) / (high - low);
    float curtain = .35 + .65 * smoothstep(0., .22, abs(within.x - .5) - .18 * random(cell, 105u));
    float room = mix(.45, 1.25, within.y) * (shop ? 1.25 : mix(1., curtain, step(.4, random(cell, 106u))));
    float level = (shop ? .95 : .5) + 1.1 * random(cell, 107u) * random(cell, 108u);
    vec2 inRoom = within * (shop ? vec2(7., 5.) : vec2(3., 4.)) + 31. * random(cell, 111u);
    room *= .45 + .95 * fractal(inRoom, 2, pixel * 4., 112u);  // furniture, goods

    float grain = fractal(surfaceUv / vec2(.5, .12), 3, pixel / .12, 109u);
    float stain = fractal(surfaceUv / vec2(.8, 5.), 3, pixel / .8, 110u);
    float brick = mix(.82 + .18 * smoothstep(.03, .10, abs(fract(surfaceUv.y / .075) - .5)), .93, smoothstep(.02, .06, pixel));
    vec3 wall = baseAlbedo * (.55 + .4 * grain + .35 * stain) * brick;
    float ledge = smoothstep(.04, .0, abs(at.y - .97)) * .35;
    vec3 albedo = mix(wall * (1. + ledge), vec3(.10, .095, .09), pane);
    albedo = mix(albedo, vec3(.012, .014, .018), glass);
    vec3 toEye = normalize(eye - worldPosition), n = normalize(worldNormal);
    float fresnel = .04 + .5 * pow(1. - max(0., dot(n, toEye)), 5.);
    vec3 reflected = skyRadiance(reflect(-toEye, n));
    vec3 emitted = glass * (on * light * room * level + fresnel * reflected);
    return Surface(albedo, n, skyShare * (.75 + .25 * grain), 20., .02 + .1 * glass, 0., emitted);
}
#elif defined(MATERIAL_Glow)
Surface surface() { return Surface(vec3(0), normalize(worldNormal), 0., 1., 0., 0., baseAlbedo); }
#endif

void main() {
    Surface s = surface();
    color = vec4(lit(s, sunVisible(worldPosition, normalize(worldNormal))), 1);
}
