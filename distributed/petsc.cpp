// Messages of any size go in pieces: MPI counts them in int.
#include "distributed/petsc.h"

#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <new>
#include <set>
#include <sstream>
#include <stdexcept>
#include <string_view>
#include <vector>

#include "base/error.h"

namespace flexel::distributed {
namespace {

constexpr std::size_t kMessage = std::size_t{1} << 30;  // bytes
constexpr int kTag = 1;
std::string first_error;     // that PETSc told since the last ok()
bool out_of_memory = false;  // likewise
std::set<std::string> given_options;

PetscErrorCode keep_error(MPI_Comm, int, const char* function, const char*, PetscErrorCode code,
                          PetscErrorType kind, const char* message, void*) {
  // Its code for want of memory is not always the one that comes.
  out_of_memory = out_of_memory || code == PETSC_ERR_MEM ||
                  (function && std::string_view(function).starts_with("PetscMalloc"));
  if (kind == PETSC_ERROR_INITIAL)
    first_error = std::string(function ? function : "PETSc") + ": " + (message ? message : "");
  return code;
}

// Without the yield that MPI leaves to who waits: other ranks may share this one's processor.
void wait(MPI_Request& request) {
  constexpr useconds_t kAsleep = 200;  // us
  int arrived = 0;
  for (;;) {
    ok(MPI_Test(&request, &arrived, MPI_STATUS_IGNORE));
    if (arrived) return;
    ::usleep(kAsleep);
  }
}

template <class Each>
void in_messages(Bytes& bytes, const Each& each) {
  for (std::size_t begin = 0; begin < bytes.size(); begin += kMessage)
    each(bytes.data() + begin, static_cast<int>(std::min(kMessage, bytes.size() - begin)));
}

}  // namespace

void ok(PetscErrorCode code) {
  if (code == 0) return;
  const std::string said = std::exchange(first_error, "");
  if (std::exchange(out_of_memory, false)) throw std::bad_alloc();
  throw std::runtime_error(said.empty() ? "PETSc or MPI failed with code " + std::to_string(code) : said);
}

Session::Session(int argc, char** argv) {
  // Ours are the arguments; PETSc's own are in one of them. Some of those count only from the beginning (-log_view).
  const std::string_view name = "--petsc";
  std::vector<std::string> words = {argv[0]};
  for (int i = 1; i < argc; ++i) {
    const std::string_view word = argv[i];
    const bool joined = word.starts_with("--petsc=");
    if (!joined && (word != name || i + 1 == argc)) continue;
    std::istringstream text(std::string(joined ? word.substr(name.size() + 1) : argv[i + 1]));
    std::string each;
    while (text >> each) words.push_back(each);
  }
  std::vector<char*> pointers;
  for (std::string& word : words) pointers.push_back(word.data());
  int count = static_cast<int>(pointers.size());
  pointers.push_back(nullptr);
  char** arguments = pointers.data();
  ok(PetscInitialize(&count, &arguments, nullptr, nullptr));
  ok(PetscPopSignalHandler());
  ok(PetscPushErrorHandler(keep_error, nullptr));
}

Session::~Session() {
  (void)PetscFinalize();
}

void Session::abort(int code) {
  std::fflush(nullptr);
  MPI_Abort(PETSC_COMM_WORLD, code);
  std::_Exit(code);
}

void Session::check_options(const std::string& text) {
  std::istringstream words(text);
  std::string word;
  while (words >> word)
    if (word.size() > 1 && word[0] == '-' && !std::isdigit(static_cast<unsigned char>(word[1])))
      given_options.insert(word.substr(1));
  if (text.find_first_not_of(" \t") != std::string::npos && given_options.empty())
    throw InputError("--petsc: \"" + text +
                     "\" names no option; options of PETSc begin with \"-\", for example --petsc "
                     "\"-ksp_view\"");
}

std::string Session::unused_options() {
  PetscInt count = 0;
  char** names = nullptr;
  char** values = nullptr;
  ok(PetscOptionsLeftGet(nullptr, &count, &names, &values));
  std::string all;
  for (PetscInt i = 0; i < count; ++i)
    if (given_options.contains(names[i])) all += (all.empty() ? "-" : ", -") + std::string(names[i]);
  ok(PetscOptionsLeftRestore(nullptr, &count, &names, &values));
  return all;
}

int rank() {
  int number = 0;
  ok(MPI_Comm_rank(PETSC_COMM_WORLD, &number));
  return number;
}

int ranks() {
  int count = 1;
  ok(MPI_Comm_size(PETSC_COMM_WORLD, &count));
  return count;
}

void broadcast(Bytes& bytes) {
  std::uint64_t size = bytes.size();
  MPI_Request request;
  ok(MPI_Ibcast(&size, 1, MPI_UINT64_T, 0, PETSC_COMM_WORLD, &request));
  wait(request);
  bytes.resize(size);
  in_messages(bytes,
              [](std::byte* data, int count) { ok(MPI_Bcast(data, count, MPI_BYTE, 0, PETSC_COMM_WORLD)); });
}

void send(int to, const Bytes& bytes) {
  std::uint64_t size = bytes.size();
  ok(MPI_Send(&size, 1, MPI_UINT64_T, to, kTag, PETSC_COMM_WORLD));
  in_messages(const_cast<Bytes&>(bytes), [&](std::byte* data, int count) {
    ok(MPI_Send(data, count, MPI_BYTE, to, kTag, PETSC_COMM_WORLD));
  });
}

Bytes receive(int from) {
  std::uint64_t size = 0;
  ok(MPI_Recv(&size, 1, MPI_UINT64_T, from, kTag, PETSC_COMM_WORLD, MPI_STATUS_IGNORE));
  Bytes bytes(size);
  in_messages(bytes, [&](std::byte* data, int count) {
    ok(MPI_Recv(data, count, MPI_BYTE, from, kTag, PETSC_COMM_WORLD, MPI_STATUS_IGNORE));
  });
  return bytes;
}

double norm(Vec vector) {
  double value = 0;
  ok(VecNorm(vector, NORM_2, &value));
  return value;
}

double sum(double own) {
  double all = 0;
  ok(MPI_Allreduce(&own, &all, 1, MPI_DOUBLE, MPI_SUM, PETSC_COMM_WORLD));
  return all;
}

}  // namespace flexel::distributed
