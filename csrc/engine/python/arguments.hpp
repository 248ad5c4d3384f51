// Arguments from Python, checked and converted.
#pragma once

#include <nanobind/nanobind.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <string>
#include <vector>

#include "engine/lander.hpp"

namespace touchdown::engine {

namespace nb = nanobind;

// A seed of any size as words in base 2^32, lowest first.
inline std::vector<std::uint32_t> entropy(const nb::int_& seed) {
  if (seed < nb::int_(0)) {
    throw nb::value_error(
        ("seed = " + std::string(nb::repr(seed).c_str()) + ": must be 0 or more").c_str());
  }
  const auto num_bits = nb::cast<std::size_t>(seed.attr("bit_length")());
  const std::size_t num_words = num_bits == 0 ? 1 : (num_bits + 31) / 32;
  const auto bytes = nb::cast<nb::bytes>(seed.attr("to_bytes")(4 * num_words, "little"));
  std::vector<std::uint32_t> words(num_words);
  std::memcpy(words.data(), bytes.c_str(), 4 * num_words);
  return words;
}
static_assert(std::endian::native == std::endian::little);

inline Config checked_config(bool continuous, double gravity, bool enable_wind, double wind_power,
                             double turbulence_power) {
  if (!(-12.0 < gravity && gravity < 0.0)) {
    throw nb::value_error(
        ("gravity = " + std::to_string(gravity) + ": must be between -12 and 0").c_str());
  }
  if (!std::isfinite(wind_power) || !std::isfinite(turbulence_power)) {
    throw nb::value_error("wind_power and turbulence_power must be finite");
  }
  return {.gravity = gravity,
          .wind_power = wind_power,
          .turbulence_power = turbulence_power,
          .continuous = continuous,
          .enable_wind = enable_wind};
}

// For a lander that was never seeded, as Gymnasium does it.
inline std::vector<std::uint32_t> entropy_of_the_system() {
  return entropy(nb::int_(nb::module_::import_("secrets").attr("randbits")(128)));
}

}  // namespace touchdown::engine
