// Where P1's sun lobe looks (its eq 5); twin of sun_offset.hpp.

// The unit direction of a way of L metres along `direction` to whose vector the scalar `offset`, in m, is added. As
// shares of L + offset, so that next to nothing neither vanishes nor divides by 0, nor do vectors that cancel. From
// 1e15 m on the offset is nothing.
vec3 offsetDirection(vec3 direction, float L, float offset) {
    if (!(offset > 1e-30 && L < 1e15)) return direction;
    float share = offset / (L + offset);
    vec3 sum = direction * (1.0 - share) + share;
    return sum / sqrt(max(dot(sum, sum), 1e-30));
}
