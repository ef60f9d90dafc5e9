/** CSS classes used by components, and selectors of stylesheets. */

import ts from 'typescript'
import { parsed, walk } from './chunks'

/** Classes in the `class` attributes of a module; `*` stands for a number. */
export function classesOf(path: string, text: string): ReadonlySet<string> {
  const file = parsed(path, text)
  const values: string[] = []
  walk(file, (node) => {
    if (ts.isJsxAttribute(node) && node.name.getText() === 'class' && node.initializer)
      values.push(...valuesOf(node.initializer, file))
  })
  return new Set(values.flatMap((value) => value.split(' ')).filter((word) => /\w/.test(word)))
}

/** Possible texts of an expression, as far as its file determines them. */
function valuesOf(node: ts.Node, file: ts.SourceFile): readonly string[] {
  const of = (...nodes: readonly ts.Node[]) => nodes.flatMap((each) => valuesOf(each, file))
  if (ts.isStringLiteralLike(node)) return [node.text]
  if (ts.isTemplateExpression(node)) {
    const texts = [node.head, ...node.templateSpans.map(({ literal }) => literal)]
    const inside = node.templateSpans.map(({ expression }) => expression)
    return [texts.map(({ text }) => text).join('*'), ...of(...inside)]
  }
  if (ts.isConditionalExpression(node)) return of(node.whenTrue, node.whenFalse)
  if (ts.isBinaryExpression(node)) return of(node.left, node.right)
  if (ts.isJsxExpression(node)) return node.expression ? of(node.expression) : []
  if (ts.isCallExpression(node)) return of(...returnsOf(node.expression.getText(), file))
  return []
}

function returnsOf(name: string, file: ts.SourceFile): readonly ts.Node[] {
  const returned: ts.Node[] = []
  for (const statement of file.statements) {
    if (!ts.isFunctionDeclaration(statement) || statement.name?.text !== name) continue
    walk(statement, (node) => {
      if (ts.isReturnStatement(node) && node.expression) returned.push(node.expression)
    })
  }
  return returned
}

/** Selectors of a stylesheet. */
export function selectorsOf(sheet: string): readonly string[] {
  const rules = sheet.replace(/\/\*.*?\*\//gs, '').replace(/@import[^;]*;/g, '')
  return [...rules.matchAll(/([^{};]+)\{/g)]
    .flatMap(([, selectors]) => selectors.split(/,(?![^(]*\))/))
    .map((selector) => selector.trim())
    .filter((selector) => !/^(@.*|from|to|\d+%)$/s.test(selector))
}

export function classesIn(selector: string): readonly string[] {
  return [...selector.matchAll(/\.([a-z][\w-]*)/gi)].map(([, name]) => name)
}
