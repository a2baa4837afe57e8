// SPDX-License-Identifier: MIT
module cilantro.clustering;

namespace cilantro {

clusters::clusters(std::vector<label> labels) : labels_{std::move(labels)} {
  std::vector<std::int32_t> counts(labels_.size()), first(labels_.size());
  std::vector<label> order;
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    const label l = labels_[i];
    expects(l < std::ssize(labels_), "clusters: a label must be below the number of points");
    if (l < 0 || counts[l]++ > 0) continue;
    first[l] = static_cast<std::int32_t>(i);
    order.push_back(l);
  }
  std::ranges::sort(order, {}, [&](label l) { return std::pair{-counts[l], first[l]}; });

  offsets_.assign(1, 0);
  std::vector<label> number(labels_.size());
  std::vector<index_t> next;
  for (const label l : order) {
    number[l] = static_cast<label>(next.size());
    next.push_back(offsets_.back());
    offsets_.push_back(offsets_.back() + counts[l]);
  }
  members_.resize(offsets_.back());
  for (std::size_t i = 0; i < labels_.size(); ++i) {
    if (labels_[i] < 0) {
      labels_[i] = none;
      continue;
    }
    labels_[i] = number[labels_[i]];
    const auto at = next[labels_[i]]++;
    members_[at] = static_cast<std::int32_t>(i);
  }
}

std::vector<index_t> clusters::sizes() const {
  std::vector<index_t> all(size());
  std::adjacent_difference(offsets_.begin() + 1, offsets_.end(), all.begin());
  return all;
}

Eigen::Matrix<float, 3, dynamic> label_colors(std::span<const clusters::label> labels) {
  // Four usual ones, then each as far in CIELAB as can be from those before it and from the grey,
  // among colours that stand out from black, white and grey.
  static constexpr std::array<std::array<int, 3>, 20> first{
      {{30, 120, 210},  {240, 135, 20},  {45, 160, 60},   {215, 45, 50},  {25, 235, 235},
       {240, 120, 195}, {220, 220, 25},  {235, 210, 150}, {120, 60, 200}, {130, 95, 25},
       {205, 190, 240}, {225, 135, 130}, {25, 135, 105},  {25, 160, 200}, {125, 80, 135},
       {155, 230, 170}, {235, 25, 115},  {145, 235, 75},  {135, 150, 25}, {200, 25, 175}}};
  constexpr float golden = 0.61803399f;  // Of a turn, which spreads any number of hues.
  Eigen::Matrix<float, 3, dynamic> colors(3, std::ssize(labels));
  for (index_t i = 0; i < colors.cols(); ++i) {
    const auto l = labels[i];
    if (l < 0) {
      colors.col(i).setConstant(0.4f);
      continue;
    }
    if (std::cmp_less(l, first.size())) {
      for (index_t c = 0; c < 3; ++c) colors(c, i) = float(first[l][c]) / 255;
      continue;
    }
    const float hue = 6 * std::fmod(0.1f + golden * float(l % 4096), 1.0f);
    const float least = l % 2 == 0 ? 0.15f : 0.4f;
    for (index_t c = 0; c < 3; ++c) {
      const float turn = std::fmod(hue + 6 - 2 * float(c), 6.0f);
      const float ramp = std::clamp(2 - std::min(turn, 6 - turn), 0.0f, 1.0f);
      colors(c, i) = least + (0.95f - least) * ramp;
    }
  }
  return colors;
}

}  // namespace cilantro
