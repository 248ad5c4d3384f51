// What Python sees of a batch; `bindings.cpp` makes the module.
#pragma once

#include <nanobind/nanobind.h>

namespace touchdown {

void bind_batch(nanobind::module_& m);

}  // namespace touchdown
