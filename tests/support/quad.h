#pragma once

namespace ist::testing {

/// 113 bits of mantissa: where there is no __float128 (g++ on ARM64) long double is that.
#ifdef __SIZEOF_FLOAT128__
using Quad = __float128;
#else
using Quad = long double;
#endif

}  // namespace ist::testing
