// Matrix products over panels of samples, with accumulators that stay in registers.
//
// A panel is [feature][kPanel]: kPanel samples, two vectors of them, lie side by side. A weight is
// thus one scalar for all samples, and layers of any width have no ragged edge.
#pragma once

#include <cstddef>
#include <type_traits>

#include "fused/vector.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

constexpr int kPanel = 2 * kWidth;  // samples in a panel

// Rows of a product computed together: as many as the instruction set has registers for.
constexpr int kTileRows = kWidth == 16 ? 12 : kWidth == 8 ? 6 : 4;

inline int num_panels(int batch_size) { return (batch_size + kPanel - 1) / kPanel; }

// Where the sums of a product start.
enum class Start {
  kRows,  // at a number for each row; no numbers are zero
  kSums,  // at what `out` has
};

// kRows rows of out = start + A·B for one panel, where A(m, k) = a[m·row + k·column] and B is
// [K][kPanel]. Every element is one chain of fused multiply-adds over k, in whatever tile it is, so
// that a value does not depend on what is computed beside it.
template <int kRows, Start kStart>
inline void multiply_rows(const float* a, std::ptrdiff_t row, std::ptrdiff_t column, const float* b,
                          int depth, const float* start, float* out) {
  Vector left[kRows], right[kRows];
  for (int m = 0; m < kRows; ++m) {
    if constexpr (kStart == Start::kRows) {
      left[m] = right[m] = broadcast(start ? start[m] : 0.0f);
    } else {
      left[m] = load(out + m * kPanel);
      right[m] = load(out + m * kPanel + kWidth);
    }
  }
  for (int k = 0; k < depth; ++k) {
    const Vector b_left = load(b + k * kPanel), b_right = load(b + k * kPanel + kWidth);
    for (int m = 0; m < kRows; ++m) {
      const Vector factor = broadcast(a[m * row + k * column]);
      left[m] += factor * b_left;
      right[m] += factor * b_right;
    }
  }
  for (int m = 0; m < kRows; ++m) {
    store(out + m * kPanel, left[m]);
    store(out + m * kPanel + kWidth, right[m]);
  }
}

// Calls `tile` with the first row and, as a compile-time constant, the number of rows of each tile.
// Tiles are as equal as possible: a small one left over would wait for its own sums.
template <int kMost, typename Tile>
inline void for_each_tile(int rows, const Tile& tile) {
  const auto call = [&]<int kRows>(const auto& self, std::integral_constant<int, kRows> size,
                                   int wanted, int first) {
    if (wanted == kRows) {
      tile(first, size);
    } else if constexpr (kRows > 1) {
      self(self, std::integral_constant<int, kRows - 1>{}, wanted, first);
    }
  };
  const int tiles = (rows + kMost - 1) / kMost;
  for (int i = 0, first = 0; i < tiles; ++i) {
    const int taken = (rows - first + tiles - i - 1) / (tiles - i);
    call(call, std::integral_constant<int, kMost>{}, taken, first);
    first += taken;
  }
}

// out = start + A·B for one panel, [rows][kPanel].
template <Start kStart = Start::kRows>
inline void multiply(const float* a, std::ptrdiff_t row, std::ptrdiff_t column, const float* b,
                     int rows, int depth, const float* start, float* out) {
  for_each_tile<kTileRows>(rows, [&]<int kRows>(int m, std::integral_constant<int, kRows>) {
    multiply_rows<kRows, kStart>(a + m * row, row, column, b, depth, start ? start + m : nullptr,
                                 out + m * kPanel);
  });
}

// The floats of a sample in an array of samples one behind the other: whole vectors.
inline std::ptrdiff_t padded(int features) { return (features + kWidth - 1) / kWidth * kWidth; }

// From a panel to its samples one behind the other, [kPanel][padded(features)]; the padding is
// undefined.
inline void to_samples(const float* panel, int features, float* samples) {
  const std::ptrdiff_t sample = padded(features);
  for (int half = 0; half < kPanel; half += kWidth, samples += kWidth * sample) {
    for (int f = 0; f < features; f += kWidth) {
      Vector block[kWidth];
      for (int i = 0; i < kWidth; ++i) {
        // beyond the last feature, any row will do
        const int from = f + i < features ? f + i : features - 1;
        block[i] = load(panel + from * kPanel + half);
      }
      transpose(block);
      for (int i = 0; i < kWidth; ++i) store(samples + i * sample + f, block[i]);
    }
  }
}

// kRows × (kColumns vectors) elements of out[row][column] = Σ over all samples of a[row]·b[column].
// The panels of `a` are `a_panel` floats apart, the samples of `b` `sample`.
template <int kRows, int kColumns>
inline void outer_products_tile(const float* a, std::ptrdiff_t a_panel, const float* b,
                                std::ptrdiff_t sample, int panels, float* out, std::ptrdiff_t row) {
  Vector total[kRows][kColumns] = {};
  for (int panel = 0; panel < panels; ++panel, a += a_panel) {
    for (int c = 0; c < kPanel; ++c, b += sample) {
      Vector columns[kColumns];
      for (int n = 0; n < kColumns; ++n) columns[n] = load(b + n * kWidth);
      for (int m = 0; m < kRows; ++m) {
        const Vector factor = broadcast(a[m * kPanel + c]);
        for (int n = 0; n < kColumns; ++n) total[m][n] += factor * columns[n];
      }
    }
  }
  for (int m = 0; m < kRows; ++m) {
    for (int n = 0; n < kColumns; ++n) store(out + m * row + n * kWidth, total[m][n]);
  }
}

// out[rows][columns] = Σ over all samples of a[row]·b[column]: a linear layer's weight gradient.
// `a` is in panels and `b` in samples, so that no vector has to be summed. Overwrites up to a
// vector of floats behind `out`.
inline void sum_outer_products(const float* a, std::ptrdiff_t a_panel, int rows, const float* b,
                               int columns, int panels, float* out) {
  const std::ptrdiff_t sample = padded(columns);
  for_each_tile<kTileRows>(rows, [&]<int kRows>(int m, std::integral_constant<int, kRows>) {
    // From the last column to the first, because the last vector of a row spills into the next row.
    std::ptrdiff_t n = sample;
    float* const to = out + static_cast<std::ptrdiff_t>(m) * columns;
    if (n / kWidth % 2 == 1) {
      n -= kWidth;
      outer_products_tile<kRows, 1>(a + m * kPanel, a_panel, b + n, sample, panels, to + n,
                                    columns);
    }
    while (n > 0) {
      n -= 2 * kWidth;
      outer_products_tile<kRows, 2>(a + m * kPanel, a_panel, b + n, sample, panels, to + n,
                                    columns);
    }
  });
}

// out[row] = Σ over all samples of term(p, row), where p is a panel and the term its vector.
template <typename Term>
inline void sum_samples(int rows, int panels, float* out, const Term& term) {
  for (int m = 0; m < rows; m += kWidth) {
    const int live = rows - m < kWidth ? rows - m : kWidth;
    Vector total[kWidth] = {};
    for (int i = 0; i < live; ++i) {
      for (int panel = 0; panel < panels; ++panel) total[i] += term(panel, m + i);
    }
    transpose(total);
    Vector sums = total[0];
    for (int i = 1; i < kWidth; ++i) sums += total[i];
    for (int i = 0; i < live; ++i) out[m + i] = sums[i];
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
