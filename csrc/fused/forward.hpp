// The forward pass: from observations to the head's outputs, one panel at a time.
#pragma once

#include <cstddef>
#include <utility>

#include "fused/layers.hpp"
#include "fused/learning.hpp"
#include "fused/network.hpp"
#include "fused/panels.hpp"
#include "fused/workspace.hpp"

namespace touchdown::fused {
namespace TOUCHDOWN_KERNEL {

// Copies the observations of `live` samples from number `first` on into a panel [D][kPanel]; the
// columns beyond them are zero. Copies them as they are too, to `rows` [kPanel][padded(D)], unless
// it is null.
inline void gather(const float* observations, const Samples& samples, std::ptrdiff_t first,
                   int live, int num_observations, float* panel, float* rows) {
  for (int c = 0; c < kPanel; ++c) {
    const std::ptrdiff_t number = first + (c < live ? c : 0);
    const std::ptrdiff_t index = samples.order ? samples.order[number] : number;
    const float* const observation = observations + index * samples.observation_stride;
    for (int d = 0; d < num_observations; ++d) {
      const float value = c < live ? observation[d] : 0.0f;
      panel[d * kPanel + c] = value;
      if (rows) rows[c * padded(num_observations) + d] = value;
    }
  }
}

// The outputs of the panel in `in`. Overwrites `in` and `out`, each [widest][kPanel].
inline void forward(const Network& network, const float* params, float* in, float* out,
                    float* state_value, float* outputs) {
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    linear_forward(layer.linear, params, in, out);
    if (network.layer_norm) {
      layer_norm_relu_forward(params + layer.gain, params + layer.shift, layer.linear.out, out,
                              nullptr, nullptr);
    } else {
      relu(out, layer.linear.out);
    }
    std::swap(in, out);
  }
  head_forward(network, params, in, state_value, outputs);
}

// The outputs of `inputs`, those of one panel, into `outputs_tm1`, storing all activations that the
// backward pass needs.
inline void forward_storing_activations(const Network& network, const float* params,
                                        const Workspace& w, int panel) {
  const float* in = w.inputs;
  for (int i = 0; i < network.num_hidden; ++i) {
    const Hidden& layer = network.hidden[i];
    const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(panel) * layer.linear.out * kPanel;
    float* const out = w.features[i] + at;
    linear_forward(layer.linear, params, in, out);
    if (network.layer_norm) {
      layer_norm_relu_forward(params + layer.gain, params + layer.shift, layer.linear.out, out,
                              w.normalized[i] + at, w.inverse_sigma[i] + panel * kPanel);
    } else {
      relu(out, layer.linear.out);
    }
    to_samples(out, layer.linear.out,
               w.feature_samples[i] + panel * kPanel * padded(layer.linear.out));
    in = out;
  }
  head_forward(network, params, in, w.state_value, w.outputs_tm1);
}

}  // namespace TOUCHDOWN_KERNEL
}  // namespace touchdown::fused
