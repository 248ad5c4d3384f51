#define TOUCHDOWN_KERNEL baseline
#define TOUCHDOWN_WIDTH 4
#define TOUCHDOWN_ROWS 4
#include "update.hpp"

namespace touchdown::fused {

extern const Kernel k_baseline{"baseline",           &baseline::workspace, &baseline::values_workspace,
                         &baseline::values, &baseline::update};

}  // namespace touchdown::fused
