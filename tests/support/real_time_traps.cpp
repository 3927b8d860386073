#include "support/real_time_traps.h"

#include <dlfcn.h>

#include <cerrno>
#include <cstdint>

namespace {

// Plain counters: a guard or a thread-local constructor would be trapped itself.
thread_local long heap_calls = 0;
thread_local long lock_calls = 0;

/// The C library's own function of that name.
template <class F>
F* next(F*& known, const char* name) noexcept {
  if (known == nullptr) known = reinterpret_cast<F*>(dlsym(RTLD_NEXT, name));
  return known;
}

}  // namespace

#if !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)

extern "C" {

void* __libc_malloc(std::size_t);
void* __libc_calloc(std::size_t, std::size_t);
void* __libc_realloc(void*, std::size_t);
void* __libc_memalign(std::size_t, std::size_t);
void __libc_free(void*);

void* malloc(std::size_t n) { return ++heap_calls, __libc_malloc(n); }
void* calloc(std::size_t n, std::size_t size) { return ++heap_calls, __libc_calloc(n, size); }
void* realloc(void* p, std::size_t n) { return ++heap_calls, __libc_realloc(p, n); }
void* memalign(std::size_t align, std::size_t n) { return ++heap_calls, __libc_memalign(align, n); }
void* aligned_alloc(std::size_t align, std::size_t n) {
  return ++heap_calls, __libc_memalign(align, n);
}
int posix_memalign(void** out, std::size_t align, std::size_t n) {
  ++heap_calls;
  *out = __libc_memalign(align, n);
  return *out != nullptr ? 0 : ENOMEM;
}
void free(void* p) { ++heap_calls, __libc_free(p); }

#define IST_TRAP_LOCK(name, exception, parameters, arguments) \
  int name parameters exception {                             \
    static int(*real) parameters exception = nullptr;         \
    ++lock_calls;                                             \
    return next(real, #name) arguments;                       \
  }

IST_TRAP_LOCK(pthread_mutex_lock, noexcept, (pthread_mutex_t * m), (m))
IST_TRAP_LOCK(pthread_mutex_trylock, noexcept, (pthread_mutex_t * m), (m))
IST_TRAP_LOCK(pthread_mutex_timedlock, noexcept, (pthread_mutex_t * m, const timespec* t), (m, t))
IST_TRAP_LOCK(pthread_rwlock_rdlock, noexcept, (pthread_rwlock_t * l), (l))
IST_TRAP_LOCK(pthread_rwlock_wrlock, noexcept, (pthread_rwlock_t * l), (l))
IST_TRAP_LOCK(pthread_rwlock_tryrdlock, noexcept, (pthread_rwlock_t * l), (l))
IST_TRAP_LOCK(pthread_rwlock_trywrlock, noexcept, (pthread_rwlock_t * l), (l))
IST_TRAP_LOCK(pthread_spin_lock, noexcept, (pthread_spinlock_t * l), (l))
IST_TRAP_LOCK(pthread_cond_signal, noexcept, (pthread_cond_t * c), (c))
IST_TRAP_LOCK(pthread_cond_broadcast, noexcept, (pthread_cond_t * c), (c))
IST_TRAP_LOCK(pthread_cond_wait, , (pthread_cond_t * c, pthread_mutex_t* m), (c, m))
IST_TRAP_LOCK(pthread_cond_timedwait, , (pthread_cond_t * c, pthread_mutex_t* m, const timespec* t),
              (c, m, t))
IST_TRAP_LOCK(pthread_once, , (pthread_once_t * o, void (*f)()), (o, f))
IST_TRAP_LOCK(sem_wait, , (sem_t * s), (s))
IST_TRAP_LOCK(sem_post, noexcept, (sem_t * s), (s))
IST_TRAP_LOCK(__cxa_guard_acquire, noexcept, (std::uint64_t * g), (g))

}  // extern "C"

#endif

namespace ist::testing {

Trapped trapped_so_far() noexcept { return {heap_calls, lock_calls}; }

namespace detail {
namespace {

/// Memory that parent and child share.
struct Watch {
  volatile int number = -1;
  volatile bool filtered = false;
  volatile bool done = false;
};
Watch* watch = nullptr;

[[noreturn]] void leave() {
  for (;;) syscall(SYS_exit_group, 0);
}

void on_system_call(int, siginfo_t* info, void*) {
  watch->number = info->si_syscall;
  leave();
}

/// Every system call but exit_group raises SIGSYS from here on.
bool trap_system_calls() {
  struct sigaction action {};
  action.sa_sigaction = on_system_call;
  action.sa_flags = SA_SIGINFO;
  sigaction(SIGSYS, &action, nullptr);
  sock_filter filter[] = {
      BPF_STMT(BPF_LD | BPF_W | BPF_ABS, offsetof(seccomp_data, nr)),
      BPF_JUMP(BPF_JMP | BPF_JEQ | BPF_K, SYS_exit_group, 0, 1),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_ALLOW),
      BPF_STMT(BPF_RET | BPF_K, SECCOMP_RET_TRAP),
  };
  const sock_fprog program = {sizeof(filter) / sizeof(*filter), filter};
  return prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) == 0 &&
         prctl(PR_SET_SECCOMP, SECCOMP_MODE_FILTER, &program, 0, 0) == 0;
}

}  // namespace

SystemCall first_system_call(void (*f)(void*), void* context) {
  void* const memory =
      mmap(nullptr, sizeof(Watch), PROT_READ | PROT_WRITE, MAP_SHARED | MAP_ANONYMOUS, -1, 0);
  if (memory == MAP_FAILED) return {};
  watch = new (memory) Watch();
  const pid_t child = fork();
  if (child == 0) {
    if (trap_system_calls()) {
      watch->filtered = true;
      f(context);
      watch->done = true;
    }
    leave();
  }
  int status = 0;
  waitpid(child, &status, 0);
  SystemCall result{watch->filtered, watch->number};
  // Neither came to its end nor made a call: it crashed, which no caller may take for silence.
  if (result.watched && !watch->done && result.number < 0) result.number = 1'000'000;
  munmap(memory, sizeof(Watch));
  return result;
}

}  // namespace detail
}  // namespace ist::testing
