/** Titled parts of a page. */

import type { ComponentChildren } from 'preact'
import { useId } from 'preact/hooks'
import type { Resource } from '../api/resource'
import { Empty, ErrorNotice, Loading } from './feedback'

type Data = Readonly<Record<`data-${string}`, string | number | boolean>>

interface CardProps {
  title: ComponentChildren
  note?: ComponentChildren
  tools?: ComponentChildren
  data?: Data
  class?: string
  children?: ComponentChildren
}

/** A region named by its title. note: below the title; tools: on the right; data: its attributes. */
export function Card({ title, note, tools, data, class: more = '', children }: CardProps) {
  const id = useId()
  const heading = <h2 id={id}>{title}</h2>
  return (
    <section class={`card ${more}`} aria-labelledby={id} {...data}>
      {note || tools ? (
        <header class={tools ? 'row spread' : undefined}>
          {heading}
          {tools}
          {note && <p class="muted small">{note}</p>}
        </header>
      ) : (
        heading
      )}
      {children}
    </section>
  )
}

/** A card in place of results that do not exist yet. */
export function EmptyCard({ title, children }: { title: string; children: ComponentChildren }) {
  return (
    <section class="card">
      <Empty title={title}>{typeof children === 'string' ? <p>{children}</p> : children}</Empty>
    </section>
  )
}

/** The content of a resource; until there is any, that it loads, or why it could not be loaded. */
export function Loaded<T>({
  resource,
  what,
  failed = `Could not load ${what}.`,
  children,
}: {
  resource: Resource<T>
  what: string
  failed?: string
  children?: (data: T) => ComponentChildren
}) {
  const { data, error, loading, reload } = resource
  return (
    <>
      {error && <ErrorNotice what={failed} error={error} retry={reload} />}
      {data === null ? loading && <Loading what={what} /> : children?.(data)}
    </>
  )
}
