#define TOUCHDOWN_KERNEL kernel_baseline
#include "lane_kernel.hpp"

namespace touchdown {

extern const Kernel k_baseline{"baseline", kernel_baseline::kGroups * 4, &kernel_baseline::iterate<4>,
                                &kernel_baseline::circle<4>};

}  // namespace touchdown
