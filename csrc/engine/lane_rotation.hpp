// Sines and cosines of many angles at once, with the C library's bits.
//
// Box2D calls the C library's sinf and cosf, so a flight has their bits. The polynomials of glibc
// (sine_series.hpp) are evaluated here in lanes. glibc's own are fused on some processors, and then
// differ by a few units in the last place of a double. Where that could show in the float, and for
// angles of 120 and more, the C library itself is asked. With another C library, whose floats
// differ, it is always asked: a sample of angles decides.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <cstring>

#include "engine/lanes.hpp"
#include "engine/math.hpp"
#include "engine/sine_series.hpp"

namespace touchdown::engine {

// Half of the lanes of a vector of floats, as doubles, which fill a register.
template <typename F>
struct HalfLanes {
  static constexpr int kCount = sizeof(F) / sizeof(float) / 2;
  typedef float Float __attribute__((vector_size(kCount * 4)));
  typedef std::int32_t Int __attribute__((vector_size(kCount * 4)));
  typedef double Double __attribute__((vector_size(kCount * 8)));
  typedef std::int64_t Long __attribute__((vector_size(kCount * 8)));
};

// The sines and cosines of half of the lanes; `known` is false where the C library must be asked.
template <typename Half>
inline void rotate_half(const float* angles, float* sines, float* cosines, std::int32_t* known) {
  using Float = typename Half::Float;
  using Int = typename Half::Int;
  using Double = typename Half::Double;
  using Long = typename Half::Long;
  Float x;
  std::memcpy(&x, angles, sizeof(x));
  const Float magnitude = x < 0.0f ? -x : x;
  const Int small = magnitude < kSmallAngle;  // false for what is no number
  const Double angle = __builtin_convertvector(small ? x : Float{}, Double);

  const Int fixed = __builtin_convertvector(angle * kQuartersPerRadian, Int);
  const Int count = (fixed + (1 << (kCountPlaces - 1))) >> kCountPlaces;
  const Double turns = __builtin_convertvector(count, Double);
  const Double rest = (angle - turns * kQuarterHigh) - turns * kQuarterLow;
  const Double odd = sine_series<PlainArithmetic>(rest);
  const Double even = cosine_series<PlainArithmetic>(rest);

  const Long quarters = __builtin_convertvector(count, Long);
  const Long swapped = (quarters & 1) != 0;
  const Double sine = swapped ? even : odd;
  const Double cosine = swapped ? odd : even;
  const Double exact_sine = (quarters & 2) != 0 ? -sine : sine;
  const Double exact_cosine = ((quarters + 1) & 2) != 0 ? -cosine : cosine;

  // The rounding to a float is safe if what is a little less and a little more has the same one.
  const Float low_sine = __builtin_convertvector(exact_sine - exact_sine * kSeriesSlack, Float);
  const Float high_sine = __builtin_convertvector(exact_sine + exact_sine * kSeriesSlack, Float);
  const Float low_cosine =
      __builtin_convertvector(exact_cosine - exact_cosine * kSeriesSlack, Float);
  const Float high_cosine =
      __builtin_convertvector(exact_cosine + exact_cosine * kSeriesSlack, Float);
  const Int tiny = magnitude < kTinyAngle;  // also keeps the sign of -0
  const Float rounded_sine = tiny ? x : low_sine;
  const Int is_known = small & (low_sine == high_sine) & (low_cosine == high_cosine);
  std::memcpy(sines, &rounded_sine, sizeof(x));
  std::memcpy(cosines, &low_cosine, sizeof(x));
  std::memcpy(known, &is_known, sizeof(x));
}

// The sines and cosines of a vector's lanes; returns which of them are right, with the polynomial
// of glibc.
template <typename F>
inline Whole<F> rotate_lanes(F angle, BasicRotation<F>& rotation) {
  using Half = HalfLanes<F>;
  constexpr std::size_t half = Half::kCount;
  alignas(sizeof(F)) std::array<float, 2 * half> angles, sines, cosines;
  alignas(sizeof(F)) std::array<std::int32_t, 2 * half> known;
  std::memcpy(angles.data(), &angle, sizeof(F));
  rotate_half<Half>(&angles[0], &sines[0], &cosines[0], &known[0]);
  rotate_half<Half>(&angles[half], &sines[half], &cosines[half], &known[half]);
  std::memcpy(&rotation.sin, sines.data(), sizeof(F));
  std::memcpy(&rotation.cos, cosines.data(), sizeof(F));
  Whole<F> is_known;
  std::memcpy(&is_known, known.data(), sizeof(F));
  return is_known;
}

// Whether the C library's sines and cosines are those of the polynomial, by a sample: 8,192 angles
// up to 120, and those next to the eighths of a turn, where the reduction loses most digits.
// Another approximation, even one that always rounds correctly, differs in one angle of a hundred.
template <typename F>
bool agrees_with_library() {
  constexpr int lanes = sizeof(F) / sizeof(float);
  const auto agrees = [](F angle) {
    BasicRotation<F> found;
    const auto known = rotate_lanes(angle, found);
    for (int lane = 0; lane < lanes; ++lane) {
      if (known[lane] == 0) continue;
      const Rotation right = rotation(angle[lane]);
      if (found.sin[lane] != right.sin || found.cos[lane] != right.cos) return false;
    }
    return true;
  };
  std::uint32_t state = 1;
  F angle;
  for (int i = 0; i < 8192; i += lanes) {
    for (int lane = 0; lane < lanes; ++lane) {
      state = state * 1664525u + 1013904223u;
      const float unit = static_cast<float>(state >> 8) * 0x1p-23f - 1.0f;
      angle[lane] = lane % 4 == 0 ? kSmallAngle * unit : 3.2f * unit;
    }
    if (!agrees(angle)) return false;
  }
  for (int eighths = -152; eighths <= 152; ++eighths) {
    const auto middle = std::bit_cast<std::int32_t>(static_cast<float>(eighths * kEighthOfTurn));
    for (int lane = 0; lane < lanes; ++lane) {
      angle[lane] = std::bit_cast<float>(middle + lane - lanes / 2);
    }
    if (!agrees(angle)) return false;
  }
  return true;
}

// The rotations by some angles, with the bits of `rotation` of each.
template <typename F>
inline BasicRotation<F> lane_rotation(F angle) {
  constexpr std::size_t lanes = sizeof(F) / sizeof(float);
  BasicRotation<F> found;
  Whole<F> known{};
  if constexpr (lanes > 4) {  // a vector of four is the baseline's, which has no wide doubles
    static const bool agrees = agrees_with_library<F>();
    if (agrees) {
      known = rotate_lanes(angle, found);
      if (all(known)) return found;
    }
  }
  for (std::size_t lane = 0; lane < lanes; ++lane) {
    if (known[lane] != 0) continue;
    const Rotation q = rotation(angle[lane]);
    found.sin[lane] = q.sin;
    found.cos[lane] = q.cos;
  }
  return found;
}

}  // namespace touchdown::engine
