/** Where a page lies below others, each a link. */

export type Crumb = readonly [label: string, href: string]

/** crumbs: from the outermost; here: the page itself. */
export function Breadcrumbs({ crumbs, here }: { crumbs: readonly Crumb[]; here: string }) {
  return (
    <nav class="breadcrumbs small" aria-label="Breadcrumbs">
      <ol>
        {crumbs.map(([label, href]) => (
          <li key={href}>
            <a href={href}>{label}</a>
          </li>
        ))}
        <li aria-current="page">{here}</li>
      </ol>
    </nav>
  )
}
