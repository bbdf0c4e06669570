// How far OpenCASCADE is with what it was asked for.
#pragma once
#include <Message_ProgressIndicator.hxx>

#include "base/program/share_scope.h"

namespace flexel::cad {

// begin()->Start() is what its functions take.
class TellsShare : public Message_ProgressIndicator {
 public:
  [[nodiscard]] static opencascade::handle<TellsShare> begin() { return new TellsShare; }

 protected:
  void Show(const Message_ProgressScope&, const Standard_Boolean) override { tell_share(GetPosition()); }
};

}  // namespace flexel::cad
