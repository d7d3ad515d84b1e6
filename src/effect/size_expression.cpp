#include "effect/size_expression.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdlib>

#include "error.hpp"
#include "nearest_name.hpp"

namespace brume {

struct SizeExpression::Node {
    enum class Kind { Number, Variable, Call } kind = Kind::Number;
    double number = 0;
    std::string name;  // of the variable, or of the function or operator called
    std::vector<std::shared_ptr<const Node>> arguments;
};

namespace {

using Node = SizeExpression::Node;
using NodePtr = std::shared_ptr<const Node>;

struct Function {
    const char* name;
    size_t arguments;
    double (*apply)(const double*);
};

const Function functions[] = {
    {"min", 2, [](const double* a) { return std::min(a[0], a[1]); }},
    {"max", 2, [](const double* a) { return std::max(a[0], a[1]); }},
    {"pow", 2, [](const double* a) { return std::pow(a[0], a[1]); }},
    {"atan2", 2, [](const double* a) { return std::atan2(a[0], a[1]); }},
    {"mod", 2, [](const double* a) { return a[0] - a[1] * std::floor(a[0] / a[1]); }},
    {"clamp", 3, [](const double* a) { return std::min(std::max(a[0], a[1]), a[2]); }},
    {"floor", 1, [](const double* a) { return std::floor(a[0]); }},
    {"ceil", 1, [](const double* a) { return std::ceil(a[0]); }},
    {"round", 1, [](const double* a) { return std::round(a[0]); }},
    {"trunc", 1, [](const double* a) { return std::trunc(a[0]); }},
    {"abs", 1, [](const double* a) { return std::abs(a[0]); }},
    {"sqrt", 1, [](const double* a) { return std::sqrt(a[0]); }},
    {"exp", 1, [](const double* a) { return std::exp(a[0]); }},
    {"log", 1, [](const double* a) { return std::log(a[0]); }},
    {"log2", 1, [](const double* a) { return std::log2(a[0]); }},
    {"log10", 1, [](const double* a) { return std::log10(a[0]); }},
    {"sin", 1, [](const double* a) { return std::sin(a[0]); }},
    {"cos", 1, [](const double* a) { return std::cos(a[0]); }},
    {"tan", 1, [](const double* a) { return std::tan(a[0]); }},
    {"asin", 1, [](const double* a) { return std::asin(a[0]); }},
    {"acos", 1, [](const double* a) { return std::acos(a[0]); }},
    {"atan", 1, [](const double* a) { return std::atan(a[0]); }},
    {"+", 2, [](const double* a) { return a[0] + a[1]; }},
    {"-", 2, [](const double* a) { return a[0] - a[1]; }},
    {"*", 2, [](const double* a) { return a[0] * a[1]; }},
    {"/", 2, [](const double* a) { return a[0] / a[1]; }},
    {"%", 2, [](const double* a) { return std::fmod(a[0], a[1]); }},
    {"^", 2, [](const double* a) { return std::pow(a[0], a[1]); }},
    {"<", 2, [](const double* a) { return double(a[0] < a[1]); }},
    {"<=", 2, [](const double* a) { return double(a[0] <= a[1]); }},
    {">", 2, [](const double* a) { return double(a[0] > a[1]); }},
    {">=", 2, [](const double* a) { return double(a[0] >= a[1]); }},
    {"==", 2, [](const double* a) { return double(a[0] == a[1]); }},
    {"!=", 2, [](const double* a) { return double(a[0] != a[1]); }},
    {"&&", 2, [](const double* a) { return double(a[0] != 0 && a[1] != 0); }},
    {"||", 2, [](const double* a) { return double(a[0] != 0 || a[1] != 0); }},
    {"!", 1, [](const double* a) { return double(a[0] == 0); }},
    {"negate", 1, [](const double* a) { return -a[0]; }},
    {"?", 3, [](const double* a) { return a[0] != 0 ? a[1] : a[2]; }},
};

const Function* findFunction(const std::string& name) {
    for (const auto& function : functions)
        if (name == function.name) return &function;
    return nullptr;
}

class Parser {
  public:
    explicit Parser(const std::string& source) : source_(source) {
        if (source.size() > 4096)
            failUsage("a size expression of ", source.size(), " characters; at most 4096");
    }

    NodePtr parse() {
        auto root = ternary();
        skipSpace();
        if (place_ < source_.size()) mistake("expected an operator");
        return root;
    }

  private:
    [[noreturn]] void mistake(const std::string& what) {
        failUsage("size expression '", source_, "', character ", place_ + 1, ": ", what);
    }
    void skipSpace() {
        while (place_ < source_.size() && std::isspace((unsigned char)source_[place_])) place_++;
    }
    bool take(const std::string& token) {
        skipSpace();
        if (source_.compare(place_, token.size(), token) != 0) return false;
        place_ += token.size();
        return true;
    }
    static NodePtr call(const std::string& name, std::vector<NodePtr> arguments) {
        return std::make_shared<Node>(Node{Node::Kind::Call, 0, name, std::move(arguments)});
    }
    struct Depth {
        Parser& parser;
        explicit Depth(Parser& p) : parser(p) {
            if (++parser.depth_ > 64) parser.mistake("nested deeper than 64");
        }
        ~Depth() { parser.depth_--; }
    };

    NodePtr ternary() {
        Depth depth(*this);
        auto condition = binary(0);
        if (!take("?")) return condition;
        auto yes = ternary();
        if (!take(":")) mistake("expected ':'");
        return call("?", {condition, yes, ternary()});
    }
    NodePtr binary(size_t level) {
        // Loosest first; within a level the longer token first, so that <= is not read as <.
        static const std::vector<std::vector<std::string>> levels = {
            {"||"}, {"&&"}, {"==", "!="}, {"<=", ">=", "<", ">"}, {"+", "-"}, {"*", "/", "%"}};
        if (level == levels.size()) return unary();
        auto left = binary(level + 1);
        for (;;) {
            bool found = false;
            for (const auto& token : levels[level]) {
                if (!take(token)) continue;
                left = call(token, {left, binary(level + 1)});
                found = true;
                break;
            }
            if (!found) return left;
        }
    }
    NodePtr unary() {
        Depth depth(*this);
        if (take("-")) return call("negate", {unary()});
        if (take("+")) return unary();
        skipSpace();
        if (source_.compare(place_, 2, "!=") != 0 && take("!")) return call("!", {unary()});
        auto base = primary();
        if (take("^")) return call("^", {base, unary()});
        return base;
    }
    NodePtr primary() {
        if (take("(")) {
            auto inner = ternary();
            if (!take(")")) mistake("expected ')'");
            return inner;
        }
        skipSpace();
        char c = place_ < source_.size() ? source_[place_] : '\0';
        if (std::isdigit((unsigned char)c) || c == '.') {
            const char* begin = source_.c_str() + place_;
            char* end = nullptr;
            double number = std::strtod(begin, &end);
            if (end == begin) mistake("not a number");
            place_ += end - begin;
            return std::make_shared<Node>(Node{Node::Kind::Number, number, "", {}});
        }
        bool variable = take("$");
        std::string name = word();
        if (name.empty()) mistake("expected a number, $name or function");
        if (variable) return std::make_shared<Node>(Node{Node::Kind::Variable, 0, name, {}});
        const Function* function = findFunction(name);
        if (!function) mistake("no function '" + name + "'; a parameter is written $" + name);
        if (!take("(")) mistake("expected '(' after " + name);
        std::vector<NodePtr> arguments;
        do arguments.push_back(ternary());
        while (take(","));
        if (!take(")")) mistake("expected ')'");
        if (arguments.size() != function->arguments)
            mistake(text(name, " takes ", function->arguments, " arguments"));
        return call(name, std::move(arguments));
    }
    std::string word() {
        size_t begin = place_;
        while (place_ < source_.size() &&
               (std::isalnum((unsigned char)source_[place_]) || source_[place_] == '_'))
            place_++;
        return source_.substr(begin, place_ - begin);
    }

    const std::string& source_;
    size_t place_ = 0;
    int depth_ = 0;
};

double evaluateNode(const Node& node, const std::map<std::string, double>& variables,
                    const std::string& source) {
    if (node.kind == Node::Kind::Number) return node.number;
    if (node.kind == Node::Kind::Variable) {
        auto found = variables.find(node.name);
        if (found != variables.end()) return found->second;
        std::vector<std::string> names;
        for (const auto& [name, value] : variables) names.push_back(name);
        failUsage("size expression '", source, "': no $", node.name, suggestion(node.name, names));
    }
    double arguments[3] = {};
    for (size_t k = 0; k < node.arguments.size(); k++)
        arguments[k] = evaluateNode(*node.arguments[k], variables, source);
    return findFunction(node.name)->apply(arguments);
}

void collectNames(const Node& node, std::vector<std::string>& names) {
    if (node.kind == Node::Kind::Variable) names.push_back(node.name);
    for (const auto& argument : node.arguments) collectNames(*argument, names);
}

}  // namespace

SizeExpression::SizeExpression() = default;

SizeExpression::SizeExpression(const std::string& source) : source_(source), root_(Parser(source).parse()) {}

std::vector<std::string> SizeExpression::names() const {
    std::vector<std::string> names;
    if (root_) collectNames(*root_, names);
    return names;
}

double SizeExpression::evaluate(const std::map<std::string, double>& variables) const {
    return evaluateNode(*root_, variables, source_);
}

}  // namespace brume
