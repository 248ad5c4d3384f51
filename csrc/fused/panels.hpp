// Matrix products over panels of samples, with accumulators that stay in registers.
//
// A panel is [feature][kPanel]: kPanel samples, two vectors of them, lie side by side. A weight is
// thus one scalar for all samples, and layers of any width have no ragged edge.
#pragma once

#include <cstddef>

#include "fused/vector.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

constexpr int kPanel = 2 * kWidth;  // samples in a panel

// Rows of a product computed together: as many as the instruction set has registers for.
constexpr int kTileRows = kWidth == 16 ? 12 : kWidth == 8 ? 6 : 4;

inline int num_panels(int batch_size) { return (batch_size + kPanel - 1) / kPanel; }

// kRows rows of out = start + A·B for one panel, where A(m, k) = a[m·row + k·column] and B is
// [K][kPanel]. Every element is one chain of fused multiply-adds over k, in whatever tile it is, so
// that a value does not depend on what is computed beside it.
template <int kRows>
inline void multiply_rows(const float* a, std::ptrdiff_t row, std::ptrdiff_t column, const float* b,
                          int depth, const float* start, float* out) {
  Vector left[kRows], right[kRows];
  for (int m = 0; m < kRows; ++m) left[m] = right[m] = broadcast(start ? start[m] : 0.0f);
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

// out = start + A·B for one panel, [rows][kPanel]; no `start` is zero.
inline void multiply(const float* a, std::ptrdiff_t row, std::ptrdiff_t column, const float* b,
                     int rows, int depth, const float* start, float* out) {
  int m = 0;
  const auto next = [&](int taken) {
    m += taken;
    a += taken * row;
    out += taken * kPanel;
    if (start) start += taken;
  };
  while (m + kTileRows <= rows) {
    multiply_rows<kTileRows>(a, row, column, b, depth, start, out);
    next(kTileRows);
  }
  while (m + 2 <= rows) {
    multiply_rows<2>(a, row, column, b, depth, start, out);
    next(2);
  }
  if (m < rows) multiply_rows<1>(a, row, column, b, depth, start, out);
}

// kRows × kColumns elements of out[row][column] = Σ over all samples of a[row]·b[column]. The
// panels of `a` are `a_panel` floats apart, those of `b` `b_panel`.
template <int kRows, int kColumns>
inline void outer_products_tile(const float* a, std::ptrdiff_t a_panel, const float* b,
                                std::ptrdiff_t b_panel, int panels, float* out,
                                std::ptrdiff_t row) {
  Vector total[kRows][kColumns] = {};
  for (int panel = 0; panel < panels; ++panel, a += a_panel, b += b_panel) {
    for (int half = 0; half < kPanel; half += kWidth) {
      Vector columns[kColumns];
      for (int n = 0; n < kColumns; ++n) columns[n] = load(b + n * kPanel + half);
      for (int m = 0; m < kRows; ++m) {
        const Vector factor = load(a + m * kPanel + half);
        for (int n = 0; n < kColumns; ++n) total[m][n] += factor * columns[n];
      }
    }
  }
  for (int m = 0; m < kRows; ++m) {
    for (int n = 0; n < kColumns; ++n) out[m * row + n] = sum(total[m][n]);
  }
}

template <int kRows>
inline void outer_products_rows(const float* a, std::ptrdiff_t a_panel, const float* b,
                                std::ptrdiff_t b_panel, int panels, int columns, float* out,
                                std::ptrdiff_t row) {
  int n = 0;
  for (; n + 3 <= columns; n += 3) {
    outer_products_tile<kRows, 3>(a, a_panel, b + n * kPanel, b_panel, panels, out + n, row);
  }
  for (; n < columns; ++n) {
    outer_products_tile<kRows, 1>(a, a_panel, b + n * kPanel, b_panel, panels, out + n, row);
  }
}

// out[rows][columns] = Σ over all samples of a[row]·b[column]: a linear layer's weight gradient.
inline void sum_outer_products(const float* a, std::ptrdiff_t a_panel, int rows, const float* b,
                               std::ptrdiff_t b_panel, int columns, int panels, float* out) {
  int m = 0;
  for (; m + 4 <= rows; m += 4) {
    outer_products_rows<4>(a + m * kPanel, a_panel, b, b_panel, panels, columns, out + m * columns,
                           columns);
  }
  for (; m < rows; ++m) {
    outer_products_rows<1>(a + m * kPanel, a_panel, b, b_panel, panels, columns, out + m * columns,
                           columns);
  }
}

// out[row] = Σ over all samples of a[row]: a bias gradient.
inline void sum_samples(const float* a, std::ptrdiff_t a_panel, int rows, int panels, float* out) {
  for (int m = 0; m < rows; ++m) {
    Vector left{}, right{};
    for (int panel = 0; panel < panels; ++panel) {
      left += load(a + panel * a_panel + m * kPanel);
      right += load(a + panel * a_panel + m * kPanel + kWidth);
    }
    out[m] = sum(left + right);
  }
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
