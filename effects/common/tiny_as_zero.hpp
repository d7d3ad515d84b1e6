// Numbers too small for their full precision, which processors take many times longer for.
#pragma once

#if defined(__SSE2__)
#include <immintrin.h>
#endif

namespace blur {

/// While it lives, this thread takes numbers below 1.2e-38 for 0: all that a recursion has left of a light
/// after hundreds of dark pixels. (Elsewhere than on x86 it does nothing.)
class TinyAsZero {
  public:
#if defined(__SSE2__)
    TinyAsZero() : before_(_mm_getcsr()) { _mm_setcsr(before_ | flushToZero | denormalsAreZero); }
    ~TinyAsZero() { _mm_setcsr(before_); }
    TinyAsZero(const TinyAsZero&) = delete;

  private:
    static constexpr unsigned flushToZero = 0x8000, denormalsAreZero = 0x40;
    unsigned before_;
#else
    TinyAsZero() {}
    ~TinyAsZero() {}
#endif
};

}  // namespace blur
