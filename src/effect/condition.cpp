// WHEN of an effect's parameters: which of them can matter beside the others' values.
#include <regex>

#include "effect/header.hpp"
#include "error.hpp"

namespace brume {

bool isUsed(const EffectHeader& header, const Parameter& parameter, const ParameterValues& values) {
    if (parameter.when.empty()) return true;
    for (const std::string& name : parameter.when.names())
        if (auto found = values.find(name); found != values.end() && found->second.automatic) return true;
    return parameter.when.evaluate(expressionVariables(header, values)) != 0;
}

std::string conditionWords(const EffectHeader& header, const Parameter& parameter,
                           std::string Parameter::*calledBy) {
    std::map<std::string, std::string> words;
    for (const Parameter& p : header.parameters) {
        words["$" + p.name] = p.*calledBy;
        for (size_t k = 0; k < p.labels.size(); k++) {
            const std::string& label = p.labels[k];
            const bool isOneWord = label.find(' ') == std::string::npos;
            words["$" + p.choiceIdentifier(k)] = isOneWord ? label : text("'", label, "'");
        }
    }
    words.insert({{"==", "is"}, {"!=", "is not"}, {"&&", "and"}, {"||", "or"}});
    static const std::regex token(R"(\$\w+|==|!=|&&|\|\|)");
    const std::string& source = parameter.when.source();
    std::string said;
    size_t end = 0;
    for (std::sregex_iterator at(source.begin(), source.end(), token), none; at != none; ++at) {
        said += source.substr(end, at->position() - end);
        const auto found = words.find(at->str());
        said += found == words.end() ? at->str() : found->second;
        end = at->position() + at->length();
    }
    said += source.substr(end);
    return said;
}

}  // namespace brume
