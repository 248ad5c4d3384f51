// The functions of the C library that the engine calls, in place of those that the toolchain
// brings.
#include "web/libm/double_sine.hpp"
#include "web/libm/hyperbolic_tangent.hpp"
#include "web/libm/single_sine.hpp"

namespace web = touchdown::web;

extern "C" {

float sinf(float x) { return web::sine(x); }
float cosf(float x) { return web::cosine(x); }
double sin(double x) { return web::sine(x); }
double cos(double x) { return web::cosine(x); }
double tanh(double x) { return web::hyperbolic_tangent(x); }

}  // extern "C"
