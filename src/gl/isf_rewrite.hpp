// Makes GLSL of the 1.20 and ES era, as published ISF files are written in, compile as 3.30. Lines stay where
// they are, so that compilers' messages keep the author's numbering.
#pragma once

#include <set>
#include <string>
#include <vector>

namespace brume {

/// A value that the vertex shader hands to the fragment shader.
struct IsfVarying {
    std::string type, name;
    std::string array;  ///< "[5]", or empty
};

/// What a file's text is found to use, so that only that is declared for it.
struct IsfUses {
    bool discards = false;      ///< pixels may be left as they were
    bool fragmentData = false;  ///< gl_FragData instead of gl_FragColor
    bool definesMain = false;
    std::set<std::string> identifiers;
    std::vector<IsfVarying> varyings;
    std::string output;  ///< of a fragment shader that declares its own instead of gl_FragColor
};

enum class IsfStage { Vertex, Fragment };

/// Replaces, identifier by identifier: names that later GLSL reserves, calls and storage words that 3.30
/// replaced, version 1 names of ISF; blanks #version and #extension lines, and declarations of what the host
/// declares (`hostNames`). Local variables without a value get 0. `main` becomes isf_main.
std::string rewriteIsf(const std::string& source, IsfStage stage, const std::set<std::string>& hostNames,
                       IsfUses& uses);

/// Neither reserved nor ill-formed, in any GLSL that brume compiles.
bool isGlslIdentifier(const std::string& name);

/// The GLSL identifier that stands for an ISF input's name: reserved names and those of GLSL's own functions
/// get a prefix, characters that GLSL forbids become _.
std::string isfIdentifier(const std::string& name);

}  // namespace brume
