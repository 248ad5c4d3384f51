// The forward pass of a few observations, as a greedy step needs it: the lanes of a vector are the
// outputs of a layer here, not samples.
//
// A panel takes the same time however few of its columns are used. Here the time grows with the
// number of observations, after weights have been transposed in registers once for all of them.
// Every number is the same chain of operations as in a panel, so its bits are the same.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstring>

#include "fused/layers.hpp"
#include "fused/network.hpp"
#include "fused/panels.hpp"
#include "fused/prediction.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// More observations than this are computed faster in a panel.
constexpr int kFew = kPanel / 4;

// The vector at `from`. What lies at `end` or behind it is not read, and undefined in the result.
inline Vector load_before(const float* end, const float* from) {
  const std::ptrdiff_t left = end - from;
  if (left >= kWidth) return load(from);
  Vector vector{};
  if (left > 0) std::memcpy(&vector, from, static_cast<std::size_t>(left) * sizeof(float));
  return vector;
}

// Adds the products of up to kWidth inputs of each observation to kWidth outputs, which begin at
// `out`. column[k] has the weights of input k.
template <bool kWhole>
inline void add_products(const Vector* column, int inputs, const float* in, std::ptrdiff_t in_row,
                         int count, float* out, std::ptrdiff_t out_row) {
  for (int n = 0; n < count; ++n, in += in_row, out += out_row) {
    Vector total = load(out);
    for (int k = 0; k < kWidth; ++k) {
      if (kWhole || k < inputs) total += broadcast(in[k]) * column[k];
    }
    store(out, total);
  }
}

// The weights of up to kWidth outputs and inputs, which begin at `weight`, as a vector per input.
inline void transposed_block(const float* weight, std::ptrdiff_t row, int outputs, const float* end,
                             Vector* block) {
  if (outputs >= kWidth && weight + (kWidth - 1) * row + kWidth <= end) {
    for (int i = 0; i < kWidth; ++i) block[i] = load(weight + i * row);
  } else {
    for (int i = 0; i < kWidth; ++i) {
      // beyond the last output, any row will do
      block[i] = load_before(end, weight + (i < outputs ? i : outputs - 1) * row);
    }
  }
  transpose(block);
}

// out[count][out_row] = bias + weight·in[count][in_row]. Rows of `out` are whole vectors, and what
// is beyond the last output is undefined. Reads no parameter at `end` or behind it.
inline void linear_forward(const Linear& linear, const float* params, const float* end,
                           const float* in, std::ptrdiff_t in_row, int count, float* out,
                           std::ptrdiff_t out_row) {
  for (int o = 0; o < linear.out; o += kWidth) {
    const Vector bias = load_before(end, params + linear.bias + o);
    for (int n = 0; n < count; ++n) store(out + n * out_row + o, bias);
    const float* const weight = params + linear.weight + static_cast<std::ptrdiff_t>(o) * linear.in;
    for (int k = 0; k < linear.in; k += kWidth) {
      Vector block[kWidth];
      transposed_block(weight + k, linear.in, linear.out - o, end, block);
      const int inputs = linear.in - k;
      if (inputs >= kWidth) {
        add_products<true>(block, kWidth, in + k, in_row, count, out + o, out_row);
      } else {
        add_products<false>(block, inputs, in + k, in_row, count, out + o, out_row);
      }
    }
  }
}

// As in a panel, in place, for the features x[count][row]. Overwrites `columns`
// [padded(features)][kWidth].
inline void layer_norm_forward(const float* gain, const float* shift, const float* end,
                               int features, int count, float* x, std::ptrdiff_t row,
                               float* columns) {
  for (int f = 0; f < features; f += kWidth) {
    Vector block[kWidth];
    for (int i = 0; i < kWidth; ++i) block[i] = load(x + (i < count ? i : 0) * row + f);
    transpose(block);
    for (int i = 0; i < kWidth; ++i) store(columns + (f + i) * kWidth, block[i]);
  }
  Vector mean{};
  for (int i = 0; i < features; ++i) mean += load(columns + i * kWidth);
  mean /= static_cast<float>(features);
  Vector variance{};
  for (int i = 0; i < features; ++i) {
    const Vector centred = load(columns + i * kWidth) - mean;
    variance += centred * centred;
  }
  variance = variance / static_cast<float>(features) + kNormEpsilon;
  for (int n = 0; n < count; ++n, x += row) {
    const float scale = 1.0f / std::sqrt(variance[n]);
    for (int f = 0; f < features; f += kWidth) {
      // loaded first, as compilers fuse only a product and a sum with no branch in between
      const Vector gains = load_before(end, gain + f), shifts = load_before(end, shift + f);
      const Vector normalized = (load(x + f) - mean[n]) * scale;
      store(x + f, gains * normalized + shifts);
    }
  }
}

// The memory that `few_values` works in. Rows are of whole vectors.
struct FewWorkspace {
  std::ptrdiff_t row;         // of a layer
  std::ptrdiff_t output_row;  // of the head
  std::ptrdiff_t value_row;   // of a dueling head's values
  float* layers[2];           // [kFew][row]: a layer's input and output
  float* outputs;             // [kFew][output_row]
  float* state_value;         // [kFew][value_row]
  float* columns;             // [features][kWidth] for layer normalisation, [Z][kPanel] for returns
};

// Lays it out in a block of memory, or only measures it if the block is null. Returns the number of
// floats.
inline std::size_t lay_out(const Network& network, float* block, FewWorkspace* workspace) {
  std::ptrdiff_t used = 0;
  const auto part = [&](std::ptrdiff_t floats) {
    float* const begin = block ? block + used : nullptr;
    used += floats;
    return begin;
  };
  FewWorkspace w{.row = padded(network.widest),
                 .output_row = padded(network.advantage.out),
                 .value_row = padded(network.prediction.outputs)};
  for (float*& layer : w.layers) layer = part(kFew * w.row);
  w.outputs = part(kFew * w.output_row);
  w.state_value = part(kFew * w.value_row);
  w.columns = part(
      std::max(kWidth * w.row, static_cast<std::ptrdiff_t>(kPanel) * network.prediction.outputs));
  if (workspace) *workspace = w;
  return static_cast<std::size_t>(used);
}

// The outputs of a dueling head for one observation, in place of the advantages.
inline void add_state_value(const Network& network, const float* state_value, float* outputs) {
  const int num_actions = network.num_actions, each = network.prediction.outputs;
  for (int z = 0; z < each; ++z) {
    float mean = 0.0f;
    for (int a = 0; a < num_actions; ++a) mean += outputs[a * each + z];
    mean /= static_cast<float>(num_actions);
    const float level = state_value[z] - mean;
    for (int a = 0; a < num_actions; ++a) outputs[a * each + z] += level;
  }
}

// Q(s,·) [count][A] of outputs [count][output_row]. For predicted returns, a lane is an observation
// and an action.
inline void action_values(const Network& network, const FewWorkspace& w, int count, float* q) {
  const int num_actions = network.num_actions, each = network.prediction.outputs;
  if (network.prediction.kind == Prediction::kMean) {
    for (int n = 0; n < count; ++n) {
      std::copy_n(w.outputs + n * w.output_row, num_actions, q + n * num_actions);
    }
    return;
  }
  const int pairs = count * num_actions;
  for (int first = 0; first < pairs; first += kWidth) {
    const int live = std::min(pairs - first, kWidth);
    for (int lane = 0; lane < kWidth; ++lane) {
      const int pair = first + std::min(lane, live - 1);  // beyond the last pair, any will do
      const float* const from =
          w.outputs + pair / num_actions * w.output_row + pair % num_actions * each;
      for (int z = 0; z < each; ++z) w.columns[z * kPanel + lane] = from[z];
    }
    const Vector mean = mean_return(network.prediction, w.columns);
    for (int lane = 0; lane < live; ++lane) q[first + lane] = mean[lane];
  }
}

// Q(s,·) of at most kFew observations [count][D], into q [count][A].
inline void few_values(const Network& network, const float* params, const float* observations,
                       int count, float* workspace, float* q) {
  FewWorkspace w;
  lay_out(network, workspace, &w);
  const float* const end = params + network.num_weights;
  const float* in = observations;
  std::ptrdiff_t in_row = network.num_observations;
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    const int features = layer.linear.out;
    float* const out = w.layers[i % 2];
    linear_forward(layer.linear, params, end, in, in_row, count, out, w.row);
    if (network.layer_norm) {
      layer_norm_forward(params + layer.gain, params + layer.shift, end, features, count, out,
                         w.row, w.columns);
    }
    for (int n = 0; n < count; ++n) {
      for (int f = 0; f < features; f += kWidth) {
        const Vector v = load(out + n * w.row + f);
        store(out + n * w.row + f, v < 0.0f ? Vector{} : v);
      }
    }
    in = out;
    in_row = w.row;
  }
  linear_forward(network.advantage, params, end, in, in_row, count, w.outputs, w.output_row);
  if (network.dueling) {
    linear_forward(network.value, params, end, in, in_row, count, w.state_value, w.value_row);
    for (int n = 0; n < count; ++n) {
      add_state_value(network, w.state_value + n * w.value_row, w.outputs + n * w.output_row);
    }
  }
  action_values(network, w, count, q);
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
