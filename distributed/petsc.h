// PETSc's objects, freed at the end of a scope, and its errors as exceptions; messages between ranks.
#pragma once
#include <petscsnes.h>

#include <string>
#include <utility>

#include "base/files/files.h"

namespace flexel::distributed {

// Throws std::bad_alloc, or std::runtime_error with what PETSc says.
void ok(PetscErrorCode code);

// A handle of PETSc's. Freeing it is collective: every rank frees the same ones in the same order.
template <class Handle, PetscErrorCode (*kDestroy)(Handle*)>
class Owned {
 public:
  Owned() = default;
  Owned(Owned&& other) noexcept : handle_(std::exchange(other.handle_, nullptr)) {}
  Owned& operator=(Owned&& other) noexcept {
    std::swap(handle_, other.handle_);
    return *this;
  }
  ~Owned() { (void)kDestroy(&handle_); }
  operator Handle() const {
    return handle_;
  }  // NOLINT(google-explicit-constructor): it stands for the handle
  [[nodiscard]] Handle* fill() { return &handle_; }

 private:
  Handle handle_ = nullptr;
};
using Vector = Owned<Vec, VecDestroy>;
using Matrix = Owned<Mat, MatDestroy>;
using Scatter = Owned<VecScatter, VecScatterDestroy>;
using Nonlinear = Owned<SNES, SNESDestroy>;
using Preconditioner = Owned<PC, PCDestroy>;
using NullSpace = Owned<MatNullSpace, MatNullSpaceDestroy>;
using Indices = Owned<IS, ISDestroy>;
using Numbering = Owned<ISLocalToGlobalMapping, ISLocalToGlobalMappingDestroy>;

// MPI and PETSc, while it lives.
class Session {
 public:
  // With what --petsc gives of PETSc's options, "-ksp_view -pc_gamg_threshold 0.02"; they go before our own.
  Session(int argc, char** argv);
  ~Session();
  Session(const Session&) = delete;
  Session& operator=(const Session&) = delete;
  // Throws InputError where `text` names none.
  static void check_options(const std::string& text);
  // Those that were given and that nothing asked for.
  [[nodiscard]] static std::string unused_options();
  // Ends every rank at once.
  [[noreturn]] static void abort(int code);
};

[[nodiscard]] int rank();
[[nodiscard]] int ranks();

// From rank 0 to all others, which wait for it without using their processors.
void broadcast(Bytes& bytes);
void send(int to, const Bytes& bytes);
[[nodiscard]] Bytes receive(int from);

// Sum over the ranks.
[[nodiscard]] double sum(double own);
[[nodiscard]] double norm(Vec vector);

}  // namespace flexel::distributed
