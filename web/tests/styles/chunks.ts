/** Stylesheets that are loaded with each module, derived from imports. */

import ts from 'typescript'

/** A module or a stylesheet, with paths relative to the sources. */
interface Source {
  readonly path: string
  readonly text: string
  /** Static imports. */
  readonly needs: readonly string[]
  /** Dynamic imports, i.e. the entries of other chunks. */
  readonly later: readonly string[]
}

export type Sources = ReadonlyMap<string, Source>

/** texts: all modules and stylesheets, by path. */
export function sourcesOf(texts: Readonly<Record<string, string>>): Sources {
  const resolved = (from: string, specifiers: readonly string[]) =>
    specifiers
      .map((specifier) => new URL(specifier, `file:///${from}`).pathname.slice(1))
      .flatMap((path) => [path, `${path}.ts`, `${path}.tsx`].filter((name) => name in texts))
  return new Map(
    Object.entries(texts).map(([path, text]) => {
      const { needs, later } = path.endsWith('.css') ? sheetImports(text) : imports(path, text)
      return [path, { path, text, needs: resolved(path, needs), later: resolved(path, later) }]
    }),
  )
}

export function parsed(path: string, text: string): ts.SourceFile {
  return ts.createSourceFile(path, text, ts.ScriptTarget.Latest, true)
}

/** Visit a node and its descendants. */
export function walk(node: ts.Node, visit: (node: ts.Node) => void): void {
  visit(node)
  ts.forEachChild(node, (child) => walk(child, visit))
}

/** Stylesheets that are certain to be loaded with each module, whatever was shown before. */
export function sheetsOfModules(sources: Sources, main: string): Map<string, Set<string>> {
  const starts = new Set([main, ...[...sources.values()].flatMap(({ later }) => later)])
  const loaded = new Map([...starts].map((start) => [start, withNeeds(sources, start)]))
  const everything = new Set(sources.keys())
  const available = new Map([...starts].map((start) => [start, everything]))
  const ofModule = (path: string) =>
    common([...starts].filter((s) => loaded.get(s)!.has(path)).map((s) => available.get(s)!))
  // A chunk depends on the chunks that load it: iterate as often as they can be nested.
  for (const _ of starts) {
    for (const start of starts) {
      const loading = [...sources.values()].filter(({ later }) => later.includes(start))
      const before = start === main ? [] : common(loading.map(({ path }) => ofModule(path)))
      available.set(start, new Set([...before, ...loaded.get(start)!]))
    }
  }
  return new Map([...sources.keys()].map((path) => [path, ofModule(path)]))
}

function withNeeds(sources: Sources, start: string): Set<string> {
  const all = new Set([start])
  for (const path of all) for (const need of sources.get(path)!.needs) all.add(need)
  return all
}

function common(sets: readonly Set<string>[]): Set<string> {
  const [first = new Set<string>(), ...others] = sets
  return new Set([...first].filter((item) => others.every((other) => other.has(item))))
}

function sheetImports(text: string) {
  return { needs: [...text.matchAll(/@import "([^"]+)"/g)].map((match) => match[1]), later: [] }
}

/** Type imports are not loaded. */
function imports(path: string, text: string) {
  const needs: string[] = []
  const later: string[] = []
  walk(parsed(path, text), (node) => {
    if (ts.isImportDeclaration(node) && !node.importClause?.isTypeOnly)
      needs.push(stringOf(node.moduleSpecifier))
    if (ts.isCallExpression(node) && node.expression.kind === ts.SyntaxKind.ImportKeyword)
      later.push(stringOf(node.arguments[0]))
  })
  return { needs, later }
}

function stringOf(node: ts.Node): string {
  return ts.isStringLiteralLike(node) ? node.text : ''
}
