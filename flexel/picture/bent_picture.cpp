// The body is moved into the picture's subject, so that memory holds it once.
#include "flexel/picture/bent_picture.h"
#include "flexel/picture/canvas/png_file.h"

#include <fmt/format.h>

#include "base/files/files.h"
#include "base/files/output_file.h"
#include "flexel/picture/picture.h"

namespace flexel::picture {

void write_bent_picture(Body& body, const std::string& path, Progress& progress) {
  PictureOptions options;
  options.colour = "displacement";
  options.exaggeration = std::nullopt;
  std::vector<PictureSubject> subjects(1);
  subjects[0].where = path;
  subjects[0].body = std::move(body);
  const PictureResult picture = draw_picture(subjects, options, progress);
  body = std::move(*subjects[0].body);
  const Bytes bytes = encode_png(picture.image);
  OutputFile out(path);
  out.write(bytes.data(), bytes.size());
  out.commit();
}

}  // namespace flexel::picture
