// Where the fields of a packed transition lie. This is the one place in C++ that knows; Python's is
// touchdown.replay.transition.transition_dtype, and the tests compare the two.
#pragma once

#include <cstddef>
#include <cstdint>

namespace touchdown::fused {

// Offsets and size in words of 4 bytes. Actions and `terminated` are int32, all else is float32.
struct TransitionFields {
  std::size_t o_tm1;  // [D]
  std::size_t a_tm1;
  std::size_t r_t;
  std::size_t discount_t;
  std::size_t terminated;
  std::size_t a_t;
  std::size_t o_t;  // [D]
  std::size_t size;
};

// For observations of `d` numbers.
constexpr TransitionFields transition_fields(std::size_t d) {
  return {.o_tm1 = 0,
          .a_tm1 = d,
          .r_t = d + 1,
          .discount_t = d + 2,
          .terminated = d + 3,
          .a_t = d + 4,
          .o_t = d + 5,
          .size = 2 * d + 5};
}

}  // namespace touchdown::fused
