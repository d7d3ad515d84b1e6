// The little language of WIDTH, HEIGHT, WHEN, REPEAT and SIZE in effect headers: arithmetic, comparison (1 or
// 0), && || !, c ? a : b, calls (min, max, floor, ceil, round, sqrt, pow, exp, log, sin, cos, abs, ...),
// numbers, and $names.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

namespace brume {

class SizeExpression {
  public:
    SizeExpression();  ///< empty
    /// Throws Error (Usage) with the place of the mistake. Depth and length are limited.
    explicit SizeExpression(const std::string& source);

    bool empty() const { return !root_; }
    const std::string& source() const { return source_; }
    /// The $names it mentions, without the dollar.
    std::vector<std::string> names() const;
    /// Throws Error (Usage) naming an unknown $name and its nearest known one.
    double evaluate(const std::map<std::string, double>& variables) const;

    struct Node;

  private:
    std::string source_;
    std::shared_ptr<const Node> root_;
};

}  // namespace brume
