#define TOUCHDOWN_KERNEL avx2
#define TOUCHDOWN_WIDTH 8
#define TOUCHDOWN_ROWS 6
#include "update.hpp"

namespace touchdown::fused {

extern const Kernel k_avx2{"avx2",           &avx2::workspace, &avx2::values_workspace,
                         &avx2::values, &avx2::update};

}  // namespace touchdown::fused
