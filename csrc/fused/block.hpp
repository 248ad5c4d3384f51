// Memory for a kernel to work in.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

namespace touchdown::fused {

// Floats that begin on a cache line. The block grows when more are asked for, and never shrinks.
class Block {
 public:
  float* of_size(std::size_t floats) {
    constexpr std::size_t line = 64;  // bytes
    const std::size_t padded = floats + line / sizeof(float);
    if (memory_.size() < padded) memory_.resize(padded);
    const auto address = reinterpret_cast<std::uintptr_t>(memory_.data());
    return memory_.data() + (line - address % line) % line / sizeof(float);
  }

 private:
  std::vector<float> memory_;
};

}  // namespace touchdown::fused
