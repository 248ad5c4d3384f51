// NumPy's default generator: PCG64 (XSL-RR, 128 bits), seeded through a SeedSequence.
//
// Sources: M. O'Neill, "PCG: A Family of Simple Fast Space-Efficient Statistically Good Algorithms
// for Random Number Generation", 2014; NumPy's NEP 19 and the documentation of SeedSequence;
// D. Lemire, "Fast Random Integer Generation in an Interval", 2019.
#pragma once

#include <array>
#include <bit>
#include <cstddef>
#include <cstdint>
#include <span>

namespace touchdown::engine {

// Mixes a seed of any length into a pool of four words, and derives a generator's seed from the
// pool.
class SeedSequence {
 public:
  // `entropy` is the seed in base 2^32, the lowest word first; the seed 0 is the one word 0.
  explicit SeedSequence(std::span<const std::uint32_t> entropy) {
    std::uint32_t multiplier = 0x43b0d7e5u;
    const auto hash = [&multiplier](std::uint32_t value) {
      value ^= multiplier;
      multiplier *= 0x931e8875u;
      value *= multiplier;
      return value ^ (value >> 16);
    };
    const auto mix = [](std::uint32_t into, std::uint32_t from) {
      const std::uint32_t mixed = 0xca01f9ddu * into - 0x4973f715u * from;
      return mixed ^ (mixed >> 16);
    };
    for (std::size_t i = 0; i < pool_.size(); ++i) {
      pool_[i] = hash(i < entropy.size() ? entropy[i] : 0u);
    }
    for (std::size_t from = 0; from < pool_.size(); ++from) {
      for (std::size_t into = 0; into < pool_.size(); ++into) {
        if (from != into) pool_[into] = mix(pool_[into], hash(pool_[from]));
      }
    }
    for (std::size_t i = pool_.size(); i < entropy.size(); ++i) {
      for (std::uint32_t& word : pool_) word = mix(word, hash(entropy[i]));
    }
  }

  // The four 64-bit words that PCG64 is seeded with.
  std::array<std::uint64_t, 4> words() const {
    std::uint32_t multiplier = 0x8b51f9ddu;
    std::array<std::uint64_t, 4> drawn{};
    for (std::size_t i = 0; i < 2 * drawn.size(); ++i) {
      std::uint32_t value = pool_[i % pool_.size()] ^ multiplier;
      multiplier *= 0x58f38dedu;
      value *= multiplier;
      value ^= value >> 16;
      drawn[i / 2] |= std::uint64_t{value} << (32 * (i % 2));
    }
    return drawn;
  }

 private:
  std::array<std::uint32_t, 4> pool_{};
};

struct Pcg64 {
  std::uint64_t state_high;
  std::uint64_t state_low;
  std::uint64_t increment_high;
  std::uint64_t increment_low;
  std::uint32_t spare_half;  // the upper half of a word whose lower half has been used
  std::uint32_t has_spare_half;

  static Pcg64 seeded(std::span<const std::uint32_t> entropy) {
    const auto words = SeedSequence(entropy).words();
    Pcg64 rng{};
    const Wide increment = join(words[2], words[3]) << 1 | 1u;
    rng.increment_high = high(increment);
    rng.increment_low = low(increment);
    rng.set_state(increment + join(words[0], words[1]));  // one step from 0, then the seed on top
    rng.advance();
    return rng;
  }

  std::uint64_t next64() {
    advance();
    return std::rotr(state_high ^ state_low, static_cast<int>(state_high >> 58));
  }

  // Each 64-bit word gives two halves, the lower first; the upper one is kept, even over a reset.
  std::uint32_t next32() {
    if (has_spare_half != 0) {
      has_spare_half = 0;
      return spare_half;
    }
    const std::uint64_t word = next64();
    has_spare_half = 1;
    spare_half = static_cast<std::uint32_t>(word >> 32);
    return static_cast<std::uint32_t>(word);
  }

  double uniform(double low, double high) {
    const double unit = static_cast<double>(next64() >> 11) * 0x1p-53;
    return low + (high - low) * unit;
  }

  // An integer in [low, high), by Lemire's multiplication with rejection.
  std::int64_t integers(std::int64_t low, std::int64_t high) {
    const auto count = static_cast<std::uint32_t>(high - low);
    std::uint64_t product = std::uint64_t{next32()} * count;
    if (static_cast<std::uint32_t>(product) < count) {
      const std::uint32_t threshold = -count % count;
      while (static_cast<std::uint32_t>(product) < threshold) {
        product = std::uint64_t{next32()} * count;
      }
    }
    return low + static_cast<std::int64_t>(product >> 32);
  }

 private:
  __extension__ using Wide = unsigned __int128;

  static constexpr Wide join(std::uint64_t high, std::uint64_t low) {
    return Wide{high} << 64 | low;
  }
  static constexpr std::uint64_t high(Wide wide) { return static_cast<std::uint64_t>(wide >> 64); }
  static constexpr std::uint64_t low(Wide wide) { return static_cast<std::uint64_t>(wide); }

  void set_state(Wide state) {
    state_high = high(state);
    state_low = low(state);
  }
  void advance() {
    constexpr Wide multiplier = join(2549297995355413924u, 4865540595714422341u);
    set_state(join(state_high, state_low) * multiplier + join(increment_high, increment_low));
  }
};

}  // namespace touchdown::engine
