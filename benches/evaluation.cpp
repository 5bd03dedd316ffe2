// Open CASCADE's side of evaluation.py: the panels of nurbs/examples/evaluate.rs by GeomAdaptor_Surface::D2, which keeps
// the polynomials of the last span at hand, and by Geom_BSplineSurface::D2. One line a panel: degrees, rational, millions
// of evaluations a second of CPU time by either, z of the point and of the mixed derivative at (0.3, 0.6).

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <vector>

#include <GeomAdaptor_Surface.hxx>
#include <Geom_BSplineSurface.hxx>
#include <TColStd_Array1OfInteger.hxx>
#include <TColStd_Array1OfReal.hxx>
#include <TColStd_Array2OfReal.hxx>
#include <TColgp_Array2OfPnt.hxx>
#include <gp_Pnt.hxx>
#include <gp_Vec.hxx>

static const int COUNT = 128;

static Handle(Geom_BSplineSurface) panel(int p, int q, bool rational)
{
    TColgp_Array2OfPnt points(1, p + 1, 1, q + 1);
    TColStd_Array2OfReal weights(1, p + 1, 1, q + 1);
    for (int i = 0; i <= p; ++i)
        for (int j = 0; j <= q; ++j) {
            const double x = double(i) / p, y = double(j) / q;
            const double z = 20.0 * std::sin(1.3 * x) + 15.0 * std::cos(1.7 * y);
            points(i + 1, j + 1) = gp_Pnt(1500.0 + 60.0 * x, 700.0 + 50.0 * y, 300.0 + z);
            weights(i + 1, j + 1) = rational ? 1.0 + 0.2 * (x - y * y) : 1.0;
        }
    TColStd_Array1OfReal knots(1, 2);
    knots(1) = 0.0;
    knots(2) = 1.0;
    TColStd_Array1OfInteger mu(1, 2), mv(1, 2);
    mu.Init(p + 1);
    mv.Init(q + 1);
    return new Geom_BSplineSurface(points, weights, knots, knots, mu, mv, p, q);
}

static double cpu()
{
    timespec t;
    clock_gettime(CLOCK_THREAD_CPUTIME_ID, &t);
    return t.tv_sec + 1e-9 * t.tv_nsec;
}

static volatile double sink;

template <class Surface> static double rate(const Surface& s, int repeats)
{
    std::vector<double> u(COUNT), v(COUNT);
    for (int k = 0; k < COUNT; ++k) {
        u[k] = std::fmod(k * 0.618, 1.0);
        v[k] = std::fmod(k * 0.755, 1.0);
    }
    const auto seconds = [&](int rounds) {
        const double before = cpu();
        gp_Pnt at;
        gp_Vec su, sv, suu, svv, suv;
        for (int r = 0; r < rounds; ++r)
            for (int k = 0; k < COUNT; ++k) {
                s.D2(u[k], v[k], at, su, sv, suu, svv, suv);
                sink = suv.X();
            }
        return cpu() - before;
    };
    int rounds = 100;
    while (seconds(rounds) < 0.02)
        rounds *= 2;
    double least = 1e300;
    for (int k = 0; k < repeats; ++k)
        least = std::min(least, seconds(rounds));
    return 1e-6 * COUNT * rounds / least;
}

int main(int count, char** arguments)
{
    const int repeats = count > 1 ? std::atoi(arguments[1]) : 15;
    const int degrees[][2] = {{1, 1}, {2, 2}, {3, 3}, {3, 5}, {5, 5}, {7, 7}, {15, 15}};
    for (const auto& d : degrees)
        for (int rational = 0; rational < 2; ++rational) {
            const Handle(Geom_BSplineSurface) surface = panel(d[0], d[1], rational);
            const GeomAdaptor_Surface adaptor(surface);
            const double kept = rate(adaptor, repeats), plain = rate(*surface, repeats);
            gp_Pnt at;
            gp_Vec su, sv, suu, svv, suv;
            surface->D2(0.3, 0.6, at, su, sv, suu, svv, suv);
            std::printf("%dx%d %d %.2f %.2f %.9f %.9f\n", d[0], d[1], rational, kept, plain, at.Z(), suv.Z());
        }
}
