#define TOUCHDOWN_KERNEL avx512
#define TOUCHDOWN_WIDTH 16
#define TOUCHDOWN_ROWS 12
#include "update.hpp"

namespace touchdown::fused {

extern const Kernel k_avx512{"avx512",           &avx512::workspace, &avx512::values_workspace,
                         &avx512::values, &avx512::update};

}  // namespace touchdown::fused
