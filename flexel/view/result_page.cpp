// The body is moved into the page's subject, so that memory holds it once.
#include "flexel/view/result_page.h"

#include "flexel/view/view_file.h"

namespace flexel::view {

void write_result_page(Body& body, const std::string& label, const RunWords& words, const std::string& path,
                       Progress& progress) {
  ViewSubject subject;
  subject.label = label;
  subject.where = path;
  subject.body = std::move(body);
  PageOptions options;
  options.words = words;
  const ViewFile file = make_view_file(subject, {}, progress);
  body = *std::move(subject.body);
  write_page({file}, options, kUsualLimit, ": write the body (-o OUT.vtu), and flexel view with --limit",
             path);
}

}  // namespace flexel::view
