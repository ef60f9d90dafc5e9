/** What the pages of walks and of controllers share: a design that the address names. */

import type { ComponentChildren } from 'preact'
import { ErrorNotice } from '../../components/feedback'
import { useProgress } from '../../job/live/use-progress'
import { ALL_JOBS, Breadcrumbs, type Crumb } from '../../router/breadcrumbs'
import { usePlace } from '../../router/navigation'
import { jobPath, withQuery } from '../../router/routes'
import { type DesignSource, queryOf } from './design-source'
import type { ResolvedDesign } from './resolve-design'

/** A page about what its address names, or about what is wrong with the address. */
export function DesignPage<A>({
  title,
  what,
  path,
  read,
  children,
}: {
  title: string
  /** As in "this address names no walk". */
  what: string
  /** Of the page, which without a query shows the published optimum. */
  path: string
  /** Throws AddressError. */
  read: (query: URLSearchParams) => A
  children: (address: A, query: URLSearchParams) => ComponentChildren
}) {
  const { query } = usePlace()
  const [address, wrong] = attempt(() => read(query))
  if (address !== null) return <>{children(address, query)}</>
  return (
    <>
      <h1>{title}</h1>
      <ErrorNotice what={`This address names no ${what}.`} error={wrong} />
      <p class="row">
        <a class="button" href={path}>
          Show the published optimum A
        </a>
      </p>
    </>
  )
}

/** Where the page of a design lies, below the job that the design is of, and its heading. */
export function DesignHeading({
  title,
  path,
  design,
  beside = [],
}: {
  title: string
  path: string
  /** Null before it is known. */
  design: ResolvedDesign | null
  /** What is shown of it, for the tab. */
  beside?: readonly string[]
}) {
  const progress = useProgress(design?.job)
  const shown = design ? [[design.label, ...beside].join(', ')] : []
  return (
    <>
      <Breadcrumbs
        {...placeOf(title, path, design)}
        title={[...shown, ...(progress ? [progress] : []), title]}
      />
      <div class="page-header">
        <h1>{title}</h1>
      </div>
    </>
  )
}

function placeOf(title: string, path: string, design: ResolvedDesign | null) {
  const { job, source } = design ?? {}
  if (!design || !job)
    return { crumbs: design ? [[title, path] as const] : [], here: design?.label ?? title }
  const crumbs: Crumb[] = [ALL_JOBS, [job.name || job.id, jobPath(job.id)]]
  if (source?.kind !== 'particle') return { crumbs, here: `${title} of the best` }
  const { iteration, particle } = source
  crumbs.push(['Iterations', jobPath(job.id, 'iterations')])
  crumbs.push([String(iteration), jobPath(job.id, `iterations/${iteration}`)])
  return { crumbs, here: `${title} of design ${particle}` }
}

/** The ways to the same design's other page, and to its job. */
export function DesignLinks({
  source,
  path,
  label,
}: {
  source: DesignSource
  /** The other page, and what its link says; null if the design has none. */
  path: string | null
  label: string
}) {
  const set = Object.entries(queryOf(source)).filter(([, value]) => value !== null)
  const query = Object.fromEntries(set) as Record<string, string>
  return (
    <div class="row">
      {path !== null && (
        <a class="button" href={withQuery(path, query)}>
          {label}
        </a>
      )}
      {'job' in source && (
        <a class="button" href={jobPath(source.job)}>
          Its job
        </a>
      )}
    </div>
  )
}

function attempt<A>(read: () => A): [A | null, unknown] {
  try {
    return [read(), null]
  } catch (error) {
    return [null, error]
  }
}
