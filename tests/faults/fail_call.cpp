// Preloaded into a program: lets one call of the C library fail. FLEXEL_FAULT="rename:3": the third rename() of the process fails
// and does nothing; "malloc:100:7": from the hundredth allocation on seven fail. FLEXEL_FAULT_COUNTS=FILE: how many calls
// of each kind there were is appended at the end. Writes to stderr do not count, for messages have to come out.
#include <dlfcn.h>
#include <fcntl.h>
#include <pthread.h>
#include <sys/types.h>
#include <unistd.h>

#include <atomic>
#include <cerrno>
#include <cstdarg>
#include <cstdio>
#include <cstdlib>
#include <cstring>

extern "C" void* __libc_malloc(std::size_t size);

namespace {

enum Kind { kWrite, kFsync, kRename, kOpen, kClose, kMalloc, kThread, kKinds };
constexpr const char* kNames[kKinds] = {"write", "fsync", "rename", "open", "close", "malloc", "thread"};
constexpr int kErrors[kKinds] = {ENOSPC, EIO, EIO, ENOSPC, EIO, ENOMEM, EAGAIN};

std::atomic<long> counts[kKinds];
std::atomic<bool> ready{false};
long first = 0, last = -1;
int wanted = kKinds;

bool fails(Kind kind) {
  if (!ready) return false;
  const long number = ++counts[kind];
  if (kind != wanted || number < first || number > last) return false;
  errno = kErrors[kind];
  return true;
}

template <class Function>
Function* real(const char* name) {
  return reinterpret_cast<Function*>(dlsym(RTLD_NEXT, name));
}

__attribute__((constructor)) void begin() {
  if (const char* fault = std::getenv("FLEXEL_FAULT")) {
    for (int kind = 0; kind < kKinds; ++kind) {
      const std::size_t length = std::strlen(kNames[kind]);
      if (std::strncmp(fault, kNames[kind], length) != 0 || fault[length] != ':') continue;
      char* rest = nullptr;
      wanted = kind;
      first = last = std::strtol(fault + length + 1, &rest, 10);
      if (*rest == ':') last = first + std::strtol(rest + 1, nullptr, 10) - 1;
    }
  }
}

__attribute__((destructor)) void end() {
  ready = false;
  const char* path = std::getenv("FLEXEL_FAULT_COUNTS");
  if (path == nullptr) return;
  if (std::FILE* file = std::fopen(path, "a")) {
    for (int kind = 0; kind < kKinds; ++kind)
      std::fprintf(file, "%s %ld\n", kNames[kind], counts[kind].load());
    std::fclose(file);
  }
}

int open_file(const char* path, int flags, mode_t mode) {
  static const auto open_now = real<int(const char*, int, mode_t)>("open");
  if ((flags & O_CREAT) != 0 && fails(kOpen)) return -1;
  return open_now(path, flags, mode);
}

int (*program)(int, char**, char**) = nullptr;

// What libraries do before main() is nobody's to catch.
int counted_main(int argc, char** argv, char** environment) {
  ready = true;
  return program(argc, argv, environment);
}

}  // namespace

extern "C" {

int __libc_start_main(int (*main)(int, char**, char**), int argc, char** argv, void (*init)(), void (*fini)(),
                      void (*rtld_fini)(), void* stack_end) {
  static const auto next =
      real<int(int (*)(int, char**, char**), int, char**, void (*)(), void (*)(), void (*)(), void*)>(
          "__libc_start_main");
  program = main;
  return next(&counted_main, argc, argv, init, fini, rtld_fini, stack_end);
}

ssize_t write(int descriptor, const void* data, size_t size) {
  static const auto next = real<ssize_t(int, const void*, size_t)>("write");
  if (descriptor != STDERR_FILENO && fails(kWrite)) return -1;
  return next(descriptor, data, size);
}

int fsync(int descriptor) {
  static const auto next = real<int(int)>("fsync");
  return fails(kFsync) ? -1 : next(descriptor);
}

int rename(const char* from, const char* to) {
  static const auto next = real<int(const char*, const char*)>("rename");
  return fails(kRename) ? -1 : next(from, to);
}

int renameat2(int from_folder, const char* from, int to_folder, const char* to, unsigned flags) {
  static const auto next = real<int(int, const char*, int, const char*, unsigned)>("renameat2");
  return fails(kRename) ? -1 : next(from_folder, from, to_folder, to, flags);
}

// After open(..., O_CREAT); the mode is there then alone.
int open(const char* path, int flags, ...) {
  va_list arguments;
  va_start(arguments, flags);
  const mode_t mode = (flags & O_CREAT) != 0 ? static_cast<mode_t>(va_arg(arguments, unsigned)) : 0;
  va_end(arguments);
  return open_file(path, flags, mode);
}

int close(int descriptor) {
  static const auto next = real<int(int)>("close");
  const int done = next(descriptor);  // a close() that fails has closed
  return fails(kClose) ? -1 : done;
}

int pthread_create(pthread_t* thread, const pthread_attr_t* attributes, void* (*start)(void*), void* given) {
  static const auto next =
      real<int(pthread_t*, const pthread_attr_t*, void* (*)(void*), void*)>("pthread_create");
  return fails(kThread) ? kErrors[kThread] : next(thread, attributes, start, given);
}

void* malloc(std::size_t size) {
  return fails(kMalloc) ? nullptr : __libc_malloc(size);
}

}  // extern "C"
