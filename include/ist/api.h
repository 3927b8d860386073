#pragma once

/// Marks the namespace of every public header: a shared library exports what is declared there, and
/// nothing else.
#if defined(__GNUC__)
#define IST_API [[gnu::visibility("default")]]
#else
#define IST_API
#endif
