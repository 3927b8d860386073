#pragma once

// Comes before every source. Highway's own target for WebAssembly (1.0.3) has no doubles, and its
// portable one is loops of single numbers. So Highway is configured for x86 with SSSE3, which
// emscripten implements by WebAssembly's vectors.

#include <hwy/detect_compiler_arch.h>

#undef HWY_ARCH_WASM
#define HWY_ARCH_WASM 0
#undef HWY_ARCH_X86_32
#define HWY_ARCH_X86_32 1
#undef HWY_ARCH_X86
#define HWY_ARCH_X86 1

#include <hwy/base.h>

// The compiler knows no such target; its command line suffices.
#undef HWY_PUSH_ATTRIBUTES
#define HWY_PUSH_ATTRIBUTES(targets)
#undef HWY_POP_ATTRIBUTES
#define HWY_POP_ATTRIBUTES
