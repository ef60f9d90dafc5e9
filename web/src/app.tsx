/** Frame of every page: header, navigation and routing. */

import type { VNode } from 'preact'
import { useEffect, useLayoutEffect, useRef } from 'preact/hooks'
import { Empty } from './components/feedback'
import icon from './icon.svg'
import { JobsPage } from './jobs/page'
import { Keys } from './palette/keys'
import { setTitle } from './router/breadcrumbs'
import { lazyPage } from './router/lazy-page'
import { usePlace } from './router/navigation'
import { forgetIgnored, IgnoredNotice } from './router/query-value'
import { type Route, routeOf } from './router/routes'
import { SignIn, useManual, useUnauthorized } from './session/session'
import { toggleTheme, useTheme } from './theme'

const NewJobPage = lazyPage('the form', () => import('./submission/page'))
const JobPage = lazyPage('the job', () => import('./job/page'))
const ComparePage = lazyPage('the comparison', () => import('./compare/page'))
const WalkPage = lazyPage('the walk', () => import('./walk/page'))
const ControllerPage = lazyPage('the controller', () => import('./controller/page'))

const LINKS = [
  { page: 'jobs', href: '/jobs', label: 'Jobs' },
  { page: 'new-job', href: '/jobs/new', label: 'New job' },
] as const

/** Pages, with their titles until they set their own. */
const PAGES: Readonly<Record<Route['page'], readonly [string, (route: Route) => VNode]>> = {
  jobs: ['Jobs', () => <JobsPage />],
  'new-job': ['New job', () => <NewJobPage />],
  job: ['Job', ({ id, tab }) => <JobPage id={id} tab={tab} />],
  compare: ['Compared jobs', () => <ComparePage />],
  walk: ['Walk', () => <WalkPage />],
  controller: ['Controller', () => <ControllerPage />],
  'not-found': ['Page not found', () => <NotFound />],
}

export function App() {
  const place = usePlace()
  const route = routeOf(place.path)
  const unauthorized = useUnauthorized()
  const manual = useManual()
  const identity = `${route.page} ${route.id}`
  return (
    <>
      <a class="skip-link" href="#main">
        Skip to content
      </a>
      <header class="masthead">
        <a class="brand" href="/jobs" aria-label="gaitswarm, jobs">
          <img src={icon} alt="" width="22" height="22" />
          <span>gaitswarm</span>
        </a>
        <nav aria-label="Main">
          {LINKS.map((link) => (
            <a
              key={link.page}
              href={link.href}
              aria-current={isUnder(route, link.page) ? 'page' : undefined}
            >
              {link.label}
            </a>
          ))}
        </nav>
        <Keys />
        <ThemeToggle />
      </header>
      {unauthorized ? (
        <main id="main">
          <SignIn />
        </main>
      ) : (
        <Main key={identity} route={route} />
      )}
      <footer class="links-below">
        <nav aria-label="More">
          <a href="/walk">Walks of any design</a>
          <a href="/controller">Controller surfaces</a>
          <a href="/docs">API</a>
          {manual && <a href="/manual">Manual</a>}
        </nav>
      </footer>
    </>
  )
}

/** The page; takes the focus after navigation, for keyboards and screen readers. */
function Main({ route }: { route: Route }) {
  const main = useRef<HTMLElement>(null)
  // A layout effect runs before the effects of the page, which may set another title.
  const [title, pageOf] = PAGES[route.page]
  useLayoutEffect(() => setTitle(title), [title])
  useEffect(() => {
    if (navigated) main.current?.focus({ preventScroll: true })
    navigated = true
    return forgetIgnored
  }, [route.page])
  return (
    <main id="main" tabIndex={-1} ref={main} data-page={route.page}>
      <IgnoredNotice />
      {pageOf(route)}
    </main>
  )
}

let navigated = false

function NotFound() {
  return (
    <Empty title="Page not found" level={1}>
      <p>
        Go to the <a href="/jobs">list of jobs</a>.
      </p>
    </Empty>
  )
}

function ThemeToggle() {
  const theme = useTheme()
  const other = theme === 'dark' ? 'light' : 'dark'
  return (
    <button
      type="button"
      class="plain compact"
      onClick={toggleTheme}
      aria-label={`Show in ${other} colours`}
    >
      {other === 'dark' ? 'Dark' : 'Light'}
    </button>
  )
}

function isUnder(route: Route, page: Route['page']): boolean {
  return route.page === page || (page === 'jobs' && ['job', 'compare'].includes(route.page))
}
