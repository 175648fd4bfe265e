#pragma once

#include <cstddef>
#include <cstdint>

namespace espalier {

/// Bounds that every reader, derivation and mesher keeps, because files are hostile. Exceeding one is an
/// ErrorKind::Limit that names it, before the memory is taken. A value equal to the limit is allowed.
struct Limits
{
    std::size_t fileBytes = std::size_t{16} << 20;
    std::uint32_t jsonDepth = 64;
    std::uint32_t jsonValues = 3u << 19; ///< Of one file. Bounds the memory that 16 MiB of "[[[0,0,..." can ask for.
    std::size_t stringBytes = std::size_t{64} << 10;
    std::uint32_t productions = 4096;      ///< Of hand-written grammars. Inferred ones may have `inferredNodes`.
    std::uint32_t constants = 4096;        ///< `let` lines of one grammar.
    std::uint32_t longSymbols = 64u << 10; ///< Declared by `symbols:`.
    std::uint32_t symbols = 65535;         ///< Different symbols of one grammar, with different numbers of parameters.
    /// Modules, formal parameters and nodes of expressions of one grammar. Bounds the memory that 16 MiB of "1+1+..."
    /// can ask for.
    std::uint32_t grammarParts = 2u << 20;
    std::uint32_t templates = 4096;
    std::uint32_t templateModules = 64u << 10;
    std::uint32_t expressionDepth = 64;
    std::uint32_t parameters = 16; ///< Of one module.
    std::uint32_t bracketDepth = 1024;
    std::uint32_t generations = 64;     ///< Nested instances of an archetype's file.
    std::uint32_t modules = 4u << 20;   ///< Of one word, before and after `interpret:`.
    std::uint32_t arguments = 8u << 20; ///< Of all modules of one word.
    /// Of one derivation, all steps together: a module that is looked at or written counts 1, a rule that is tried or
    /// applied 8, an instruction of an expression 4, a function that it calls 64. Some tenths of a second.
    std::uint32_t derivationWork = 256u << 20;
    std::uint32_t nodes = 1u << 20;         ///< Segments of one skeleton; instances of one archetype read from a file.
    std::uint32_t inferredNodes = 4u << 20; ///< Instances and productions of an inference.
    std::uint32_t vertices = 16u << 20;
    std::uint32_t texels = 32u << 20; ///< Of all pictures that one appearance names: four bytes each.
    double angleDegrees = 3600.0;     ///< Largest magnitude of an angle in a file.
    double coordinate = 1e5;          ///< Largest magnitude of a coordinate or length, metres.

    /// For a grammar that may be inferred: inference writes more than people do.
    [[nodiscard]] constexpr Limits ofInferredGrammars() const noexcept
    {
        Limits wider = *this;
        wider.productions = productions > inferredNodes ? productions : inferredNodes;
        wider.grammarParts = grammarParts > 2 * inferredNodes ? grammarParts : 2 * inferredNodes;
        return wider;
    }
};

} // namespace espalier
