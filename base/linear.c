// SPDX-License-Identifier: Apache-2.0
#include "base/linear.h"

struct mat3 mat3_identity(void)
{
    return (struct mat3){{{1, 0, 0}, {0, 1, 0}, {0, 0, 1}}};
}

struct mat3 mat3_mul(struct mat3 a, struct mat3 b)
{
    struct mat3 c;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            c.m[i][j] = a.m[i][0] * b.m[0][j] + a.m[i][1] * b.m[1][j] + a.m[i][2] * b.m[2][j];
    return c;
}

struct mat3 mat3_transpose(struct mat3 a)
{
    struct mat3 t;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            t.m[i][j] = a.m[j][i];
    return t;
}

struct vec3 mat3_apply(struct mat3 a, struct vec3 v)
{
    return (struct vec3){
        a.m[0][0] * v.x + a.m[0][1] * v.y + a.m[0][2] * v.z,
        a.m[1][0] * v.x + a.m[1][1] * v.y + a.m[1][2] * v.z,
        a.m[2][0] * v.x + a.m[2][1] * v.y + a.m[2][2] * v.z,
    };
}

struct mat3 mat3_rotation(int axis, double angle)
{
    int u = (axis + 1) % 3, v = (axis + 2) % 3;
    struct mat3 r = mat3_identity();
    r.m[u][u] = r.m[v][v] = cos(angle);
    r.m[v][u] = sin(angle);
    r.m[u][v] = -r.m[v][u];
    return r;
}

static double cofactor(struct mat3 a, int i, int j)
{
    int r0 = (i + 1) % 3, r1 = (i + 2) % 3, c0 = (j + 1) % 3, c1 = (j + 2) % 3;
    return a.m[r0][c0] * a.m[r1][c1] - a.m[r0][c1] * a.m[r1][c0];
}

bool mat3_invert(struct mat3 a, struct mat3 *out)
{
    double det = 0;
    for (int j = 0; j < 3; j++)
        det += a.m[0][j] * cofactor(a, 0, j);
    if (det == 0 || !isfinite(det))
        return false;
    for (int i = 0; i < 3; i++)
        for (int j = 0; j < 3; j++)
            out->m[i][j] = cofactor(a, j, i) / det;
    return true;
}

// One-sided Jacobi on the columns: accurate where a'a would lose half the digits.
double mat3_condition(struct mat3 a)
{
    for (int sweep = 0; sweep < 30; sweep++) {
        double off = 0;
        for (int p = 0; p < 2; p++) {
            for (int q = p + 1; q < 3; q++) {
                double pp = 0, qq = 0, pq = 0;
                for (int i = 0; i < 3; i++) {
                    pp += a.m[i][p] * a.m[i][p];
                    qq += a.m[i][q] * a.m[i][q];
                    pq += a.m[i][p] * a.m[i][q];
                }
                if (pq == 0)
                    continue;
                off = fmax(off, fabs(pq) / sqrt(pp * qq));
                double zeta = (qq - pp) / (2 * pq);
                double t = copysign(1, zeta) / (fabs(zeta) + hypot(1, zeta));
                double c = 1 / hypot(1, t), s = c * t;
                for (int i = 0; i < 3; i++) {
                    double x = a.m[i][p], y = a.m[i][q];
                    a.m[i][p] = c * x - s * y;
                    a.m[i][q] = s * x + c * y;
                }
            }
        }
        if (off < 1e-15)
            break;
    }
    double least = INFINITY, most = 0;
    for (int j = 0; j < 3; j++) {
        double s = hypot(hypot(a.m[0][j], a.m[1][j]), a.m[2][j]);
        least = fmin(least, s);
        most = fmax(most, s);
    }
    return least > 0 ? most / least : INFINITY;
}

struct vec3 rigid_apply(struct rigid t, struct vec3 p)
{
    return vec3_add(mat3_apply(t.rotation, p), t.translation);
}

struct rigid rigid_mul(struct rigid a, struct rigid b)
{
    return (struct rigid){mat3_mul(a.rotation, b.rotation), rigid_apply(a, b.translation)};
}

struct rigid rigid_inverse(struct rigid t)
{
    struct mat3 back = mat3_transpose(t.rotation);
    return (struct rigid){back, vec3_scale(mat3_apply(back, t.translation), -1)};
}
