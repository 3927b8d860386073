#pragma once

/// Stands at the namespace of every public header: what is declared there is seen from outside of a
/// shared library, and nothing else is.
#if defined(__GNUC__)
#define IST_API [[gnu::visibility("default")]]
#else
#define IST_API
#endif
