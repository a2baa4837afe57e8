// SPDX-License-Identifier: MIT
//
// The one unit that knows Qhull, through its reentrant C interface. No module unit: it knows
// nothing of modules.
#include "spatial/qhull.hpp"

#include <cstdio>
#include <cstdlib>
#include <new>
#include <string_view>

extern "C" {
#include <libqhull_r/qhull_ra.h>
}

namespace cilantro::detail {
namespace {

/// What Qhull has written, in memory.
class captured_text {
 public:
  captured_text() : file_{open_memstream(&text_, &size_)} {
    if (!file_) throw std::bad_alloc{};
  }
  captured_text(const captured_text&) = delete;
  captured_text& operator=(const captured_text&) = delete;
  ~captured_text() {
    std::fclose(file_);
    std::free(text_);
  }
  [[nodiscard]] std::FILE* file() const { return file_; }

  /// The first line, which begins with the number of the message.
  [[nodiscard]] std::string first_line() {
    std::fflush(file_);
    const std::string_view all{text_, size_};
    return std::string{all.substr(0, all.find('\n'))};
  }

 private:
  char* text_ = nullptr;
  std::size_t size_ = 0;
  std::FILE* file_ = nullptr;
};

class qhull_run {
 public:
  qhull_run() { qh_zero(&qh_, messages_.file()); }
  qhull_run(const qhull_run&) = delete;
  qhull_run& operator=(const qhull_run&) = delete;
  ~qhull_run() {
    int left = 0, total = 0;
    qh_freeqhull(&qh_, !qh_ALL);
    qh_memfreeshort(&qh_, &left, &total);
  }

  [[nodiscard]] bool hull(const double* points, int count, int dimension, const char* options) {
    // It only reads the points, and the command.
    return qh_new_qhull(&qh_, dimension, count, const_cast<double*>(points), False,
                        const_cast<char*>(options), nullptr, messages_.file()) == 0;
  }

  void read_facets(int dimension, qhull_facets& out) {
    qhT* qh = &qh_;
    facetT *facet, *neighbor, **neighborp;
    vertexT *vertex, **vertexp;
    std::vector<std::int32_t> order;
    if (dimension > 3) {
      order.assign(qh->facet_id, -1);
      std::int32_t count = 0;
      FORALLfacets order[facet->id] = count++;
    }
    FORALLfacets {
      FOREACHvertex_(facet->vertices) out.vertices.values.push_back(qh_pointid(qh, vertex->point));
      out.vertices.close();
      out.normals.insert(out.normals.end(), facet->normal, facet->normal + dimension);
      if (dimension <= 3) continue;
      FOREACHneighbor_(facet) out.neighbors.values.push_back(order[neighbor->id]);
      out.neighbors.close();
    }
  }

  [[nodiscard]] std::string message() { return messages_.first_line(); }

 private:
  captured_text messages_;
  qhT qh_;
};

}  // namespace

qhull_facets run_qhull(const double* points, int count, int dimension, double merged) {
  qhull_facets out;
  // Q5: how far points are beyond the planes is not asked of Qhull, since planes are made anew.
  // Searching all points for the first simplex helps where the usual search finds a flat one. That
  // wide facets may stay is the last resort; results are verified by the caller.
  for (const char* more : {"", " Qs", " Qs Q12"}) {
    char options[64];
    if (merged > 0)
      std::snprintf(options, sizeof options, "qhull Pp Q5 C-%.3g%s", merged, more);
    else
      std::snprintf(options, sizeof options, "qhull Pp Q5%s", more);
    qhull_run run;
    if (run.hull(points, count, dimension, options)) {
      out.error.clear();
      run.read_facets(dimension, out);
      return out;
    }
    out.error = run.message();
    if (out.error.empty()) out.error = "Qhull found no hull";
  }
  return out;
}

}  // namespace cilantro::detail
