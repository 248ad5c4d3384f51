#define TOUCHDOWN_KERNEL kernel_baseline
#include "lane_kernel.hpp"

namespace touchdown {

extern const Kernel k_baseline{"baseline", 2 * 4, &kernel_baseline::solve<4>};

}  // namespace touchdown
