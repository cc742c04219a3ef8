// The ensemble kernel's algorithm in C, for the paper's disk and the scheme euler: the same noise,
// the same polynomials, lanes as the innermost loop. With -DXOSHIRO another generator, with -DLIBM
// the library's logarithm, sine and cosine.

#include <math.h>
#include <stdint.h>
#include <string.h>

#define LANES 128
#define LANES_LOOP _Pragma("omp simd") for (int i = 0; i < LANES; i++)
#define INLINE static inline __attribute__((always_inline))

static const double two_pi = 6.283185307179586;

INLINE double as_float(uint64_t bits) { double number; memcpy(&number, &bits, 8); return number; }
INLINE uint64_t as_bits(double number) { uint64_t bits; memcpy(&bits, &number, 8); return bits; }
INLINE uint64_t rotated(uint64_t x, int by) { return (x << by) | (x >> (64 - by)); }
INLINE double unit(uint64_t bits) { return as_float((bits >> 12) | 0x3FF0000000000000); }  // [1, 2)

#ifdef LIBM

INLINE double sine_of_quarter(double q) { return sin(two_pi * q); }
INLINE double cosine_of_quarter(double q) { return cos(two_pi * q); }
INLINE double cosine(double turns) { return cos(two_pi * turns); }
INLINE double logarithm(double number) { return log(number); }

#else

INLINE double sine_of_quarter(double q) {
    double y = q * q;
    double p = -0.7177337921413454 + y * 0.10089695501646812;
    p = -15.0946416761179 + y * (3.8199280942271643 + y * p);
    p = -76.70585975282492 + y * (42.058693925428685 + y * p);
    p = -41.341702240399755 + y * (81.60524927607362 + y * p);
    return q * (two_pi + y * p);
}

INLINE double cosine_of_quarter(double q) {
    double y = q * q;
    double p = -1.7132184107005932 + y * 0.2719458494999813;
    p = -26.426254066690255 + y * (7.903462492085097 + y * p);
    p = -85.45681720598061 + y * (60.24464131316041 + y * p);
    p = -19.739208802178705 + y * (64.93939402266395 + y * p);
    return 1.0 + y * p;
}

INLINE double cosine(double turns) { return sine_of_quarter(0.25 - fabs(turns - rint(turns))); }

INLINE double logarithm(double number) {
    int64_t bits = (int64_t)as_bits(number);
    int64_t k = (bits - 0x3FE6A09E667F3BCD) >> 52;
    double z = as_float((uint64_t)(bits - (k << 52)));
    double s = (z - 1.0) / (z + 1.0), y = s * s;
    double p = 0.15331721600556042 + y * 0.14616449685043406;
    p = 0.2222221113479508 + y * (0.18182889125261723 + y * p);
    p = 0.666666666666667 + y * (0.39999999999899505 + y * (0.28571428625975487 + y * p));
    return (double)k * 0.6931471805599453 + s * (2.0 + y * p);
}

#endif

#define MIX(rotation) x += y, y = rotated(y, rotation) ^ x

INLINE void threefry(uint64_t *a, uint64_t *b, uint64_t seed, uint64_t replica) {
    uint64_t third = 0x1BD11BDAA9FC1A22 ^ seed ^ replica, x = *a + seed, y = *b + replica;
    MIX(16), MIX(42), MIX(12), MIX(31);
    x += replica, y += third + 1;
    MIX(16), MIX(32), MIX(24), MIX(21);
    x += third, y += seed + 2;
    MIX(16), MIX(42), MIX(12), MIX(31);
    x += seed, y += replica + 3;
    MIX(16);
    *a = x, *b = y;
}

INLINE uint64_t splitmix(uint64_t *state) {
    uint64_t z = *state += 0x9E3779B97F4A7C15;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EB;
    return z ^ (z >> 31);
}

INLINE uint64_t xoshiro(uint64_t (*s)[LANES], int i) {  // xoshiro256++
    uint64_t result = rotated(s[0][i] + s[3][i], 23) + s[0][i], t = s[1][i] << 17;
    s[2][i] ^= s[0][i], s[3][i] ^= s[1][i], s[1][i] ^= s[2][i], s[0][i] ^= s[3][i];
    s[2][i] ^= t;
    s[3][i] = rotated(s[3][i], 45);
    return result;
}

// `states` holds rows x in turns, theta, v, omega of a number of replicas that LANES divides; `law`
// the friction matrix by rows, the noise on v and omega, the kick, and the drifts in turns and angle.
void advance(double *states, int64_t replicas, int64_t steps, uint64_t seed, const double *law) {
    const double f0 = law[0], f1 = law[1], f2 = law[2], f3 = law[3];
    const double noise_v = law[4], noise_omega = law[5];
    const double kick = law[6], turns = law[7], angle = law[8];
    _Alignas(64) double work[4][LANES], normals[2][LANES];
    _Alignas(64) uint64_t words[2][LANES];
    double *x = work[0], *theta = work[1], *v = work[2], *omega = work[3];
#ifdef XOSHIRO
    _Alignas(64) uint64_t state[4][LANES];
#endif
    for (int64_t group = 0; group < replicas; group += LANES) {
        for (int row = 0; row < 4; row++)
            memcpy(work[row], states + row * replicas + group, sizeof work[row]);
#ifdef XOSHIRO
        for (int i = 0; i < LANES; i++) {
            uint64_t start = (seed << 32) + (uint64_t)(group + i) * 4 * 0x9E3779B97F4A7C15;
            for (int row = 0; row < 4; row++) state[row][i] = splitmix(&start);
        }
#endif
        for (int64_t step = 0; step < steps; step++) {
            if (step % 2 == 0) {
                LANES_LOOP {
#ifdef XOSHIRO
                    uint64_t a = xoshiro(state, i), b = xoshiro(state, i);
#else
                    uint64_t a = (uint64_t)step / 2, b = 0;
                    threefry(&a, &b, seed, (uint64_t)(group + i));
#endif
                    words[0][i] = a, words[1][i] = b;
                }
                LANES_LOOP {
                    uint64_t a = words[0][i], b = words[1][i];
                    double radius = sqrt(-2.0 * logarithm(2.0 - unit(a)));
                    double q = 0.5 * (unit(b) - 1.5);
                    double with_sign = as_float(as_bits(radius) | (b << 63));
                    normals[0][i] = with_sign * cosine_of_quarter(q);
                    normals[1][i] = radius * sine_of_quarter(q);
                }
            }
            const double *xi = normals[step % 2];
            LANES_LOOP {
                double dv = f0 * v[i] + f1 * omega[i] + noise_v * xi[i];
                double domega = f2 * v[i] + f3 * omega[i] + noise_omega * xi[i];
                v[i] += dv + kick * cosine(x[i]);
                omega[i] += domega;
                x[i] += turns * v[i];
                theta[i] += angle * omega[i];
            }
        }
        for (int row = 0; row < 4; row++)
            memcpy(states + row * replicas + group, work[row], sizeof work[row]);
    }
}
